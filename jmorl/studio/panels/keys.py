"""The keyboard: the command of each key, and the list of the keys."""

from nicegui import ui
from nicegui.events import KeyEventArguments

from jmorl.display.readings import reading_label
from jmorl.studio import texts, words
from jmorl.studio.tab import Tab

STEERING = ("=", "c", "f", "k")  # keys of commands that steer


class Keys:
    """The keys of a tab, and the button that lists them."""

    def __init__(self, tab: Tab):
        self.tab = tab
        ui.keyboard(self._press, ignore=["input", "select", "textarea"], repeating=True)
        with ui.dialog().props('aria-label="Keys"').bind_value_to(tab, "covered") as self.list, ui.card():
            ui.label(words.KEY_LIST).classes("title")
            with ui.element("dl").classes("keys"):
                for key, what in words.KEYS:
                    if tab.access.watching and key in STEERING:
                        continue
                    with ui.element("dt"):
                        ui.label(key)
                    with ui.element("dd"):
                        ui.label(what)
            for number, objective in enumerate(tab.view.objectives, start=1):
                ui.label(f"{number}: {reading_label(objective)}")
            ui.button(words.CLOSE, on_click=self.list.close).props("flat no-caps")
        ui.button(words.KEY_LIST, on_click=self.list.open).props("flat dense no-caps size=sm")

    async def _press(self, event: KeyEventArguments) -> None:
        modified = event.modifiers.ctrl or event.modifiers.alt or event.modifiers.meta
        if not event.action.keydown or modified or self.tab.covered:
            return
        key, focus = event.key, self.tab.selection.focus
        if key.arrow_left or key.arrow_right:
            self.tab.look_along(1 if key.arrow_right else -1)
        elif event.action.repeat:  # a key that is held down answers once
            return
        elif key.number and key.number <= len(self.tab.view.objectives):
            self.tab.more_of(key.number - 1)
        elif key == "?":
            self.list.open()
        elif key == "c" and focus is not None:
            self.tab.choose(focus)
        elif key == "f" and focus is not None:
            await self.tab.favour(focus)
        elif key == "=" and texts.offers_equal(self.tab.view):
            self.tab.say_equal()
        elif key == "x" and focus is not None:
            self.tab.put_away(focus)
        elif key == "k":
            self.tab.keep()
