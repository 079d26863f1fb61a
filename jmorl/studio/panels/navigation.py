"""E-NAUTILUS on the page: from the worst corner of the front to one of its policies, choice by choice."""

from nicegui import ui

from jmorl.decision.answers import Adjust, Back, Choose
from jmorl.decision.enautilus import IntermediatePoint
from jmorl.decision.protocol import PointQuestion
from jmorl.display.readings import reading_label
from jmorl.display.text import plural
from jmorl.search.scaling import range_scale
from jmorl.studio import texts, words
from jmorl.studio.dialogue import Dialogue
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab

ITERATIONS, POINTS = 3, 3


class NavigationPanel:
    """The dialogue as the session has it, or the way into one."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.seen, self.shown = Shown(), Shown()
        self.body = ui.element("div").classes("navigation")

    def show(self) -> None:
        """Show where the dialogue stands; replace nothing that somebody is about to press, or has typed."""
        view, dialogue = self.tab.view, self.tab.dialogue
        if not self.seen.is_new(view, dialogue):
            return
        chosen = dialogue.chosen if dialogue else None
        if not self.shown.is_new(dialogue, chosen is not None and view.choosable(chosen.id)):
            return
        self.body.clear()
        with self.body:
            if dialogue is None and self.tab.access.watching:
                ui.label(words.NO_DIALOGUE).classes("explanation")
            elif dialogue is None:
                self._add_beginning()
            elif dialogue.chosen:
                self._add_end(dialogue)
            else:
                self._add_question(dialogue, dialogue.question)

    def _add_beginning(self) -> None:
        ui.label(
            "E-NAUTILUS leads you from the worst value of every objective to one policy of the front, in a few choices "
            "among points each of which is better in everything than where you are: nothing has to be given up."
        ).classes("explanation")
        with ui.element("div").classes("controls"):
            iterations = _number("iterations", ITERATIONS)
            points = _number("points in each", POINTS)
            begin = ui.button(words.BEGIN, on_click=lambda: self._begin(iterations, points))
            begin.props("no-caps dense color=primary")

    def _add_question(self, dialogue: Dialogue, question: PointQuestion) -> None:
        state = question.state
        ui.label(
            f"On the front after round {question.generation}: {int(state.reachable.sum())} of "
            f"{plural(len(question.front), 'policy')} reachable. Which point do you prefer? A bar goes from the worst "
            "to the best value that stays reachable from it."
        ).classes("explanation")
        for number, point in enumerate(question.points, start=1):
            self._add_point(dialogue, question, number, point)
        if self.tab.access.watching:
            return
        with ui.element("div").classes("controls"):
            iterations = _number("iterations left", state.iterations_left)
            points = _number("points in each", state.points)
            change = ui.button(words.CHANGE, on_click=lambda: self._adjust(dialogue, iterations, points))
            change.props("no-caps dense outline")
            back = ui.button(words.STEP_BACK, on_click=lambda: self.tab.reply(dialogue, Back(1)))
            back.props("no-caps dense outline")
            back.set_enabled(state.choices > 0)
            ui.button(words.CLOSE, on_click=self.tab.close_dialogue).props("no-caps dense flat")

    def _add_point(self, dialogue: Dialogue, question: PointQuestion, number: int, point: IntermediatePoint) -> None:
        scale, writers = range_scale(question.state.values), texts.writers_of(self.tab.view)
        worst, best = scale.apply(point.value), scale.apply(point.best)
        with ui.element("div").classes("point"):
            ui.label(str(number)).classes("point-number")
            with ui.element("div").classes("point-ranges"):
                for index, objective in enumerate(question.objectives):
                    ui.label(reading_label(objective)).classes("point-objective")
                    with ui.element("div").classes("range").props('aria-hidden="true"'):
                        width = max(100 * (best[index] - worst[index]), 1.5)
                        ui.element("div").style(f"left: {100 * worst[index]:.1f}%; width: {width:.1f}%")
                    ui.label(texts.minus(writers[index].span(point.value[index], point.best[index])))
            with ui.element("div").classes("point-side"):
                ui.label(f"{point.closeness:.0f} % of the way")
                ui.label(f"{plural(int(point.reachable.sum()), 'policy')} left")
            if not self.tab.access.watching:
                choose = ui.button(words.PREFER, on_click=lambda: self.tab.reply(dialogue, Choose(number - 1)))
                choose.props("no-caps dense outline")

    def _add_end(self, dialogue: Dialogue) -> None:
        chosen = dialogue.chosen
        assert chosen
        ui.label(f"E-NAUTILUS ends on policy {chosen.id}: {texts.scores(self.tab.view, chosen)}.").classes("ending")
        if self.tab.view.choosable(chosen.id) and not self.tab.access.watching:
            ui.label(words.LAID_OUT_BELOW).classes("explanation")
        with ui.element("div").classes("controls"):
            look = ui.button(words.LOOK_AT_IT, on_click=lambda: self.tab.look_at(chosen.id))
            look.props("no-caps dense color=primary")
            if self.tab.access.watching:
                return
            undo = ui.button(words.STEP_BACK, on_click=self.tab.undo_reply).props("no-caps dense outline")
            undo.set_enabled(dialogue.before is not None)
            ui.button(words.BEGIN_AGAIN, on_click=self.tab.close_dialogue).props("no-caps dense flat")

    async def _begin(self, iterations: ui.number, points: ui.number) -> None:
        await self.tab.begin_dialogue(_whole(iterations), _whole(points))

    async def _adjust(self, dialogue: Dialogue, iterations: ui.number, points: ui.number) -> None:
        await self.tab.reply(dialogue, Adjust(_whole(iterations), _whole(points)))


def _number(label: str, value: int) -> ui.number:
    ui.label(label)
    number = ui.number(value=value, min=1, max=20, format="%d")
    number.props(f'dense outlined aria-label="{label}"').classes("count")
    return number


def _whole(number: ui.number) -> int:
    return int(number.value or 0)
