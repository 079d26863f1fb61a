"""The switch for being called when a question opens."""

from nicegui.element import Element

from jmorl.studio import texts, words
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab


class Bell(Element, component="call.js"):
    """The switch, and the call, in the browser."""


class Call:
    """The switch, which is told of each question once, when it opens."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.shown = Shown()
        self.bell = Bell()
        self.bell.props["label"], self.bell.props["hint"] = words.CALL, words.CALL_HINT

    def show(self) -> None:
        """Name the question that is open."""
        view = self.tab.view
        question = view.question
        if not self.shown.is_new(question):
            return
        at = (view.run, question.purpose, question.generation, question.again, len(view.choices)) if question else ()
        self.bell.props["question"] = " ".join(map(str, at))
        self.bell.props["text"] = texts.title(view)
        self.bell.update()
