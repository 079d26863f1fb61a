"""The form of a new run on the home page."""

from collections.abc import Callable, Mapping

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from jmorl.display.text import short_count
from jmorl.presets import PRESETS
from jmorl.studio import home_texts, words
from jmorl.studio.home_tab import HomeTab
from jmorl.studio.panels.panel import Shown

Changed = Callable[[ValueChangeEventArguments[str | None]], None]


class RunForm:
    """Fields for what a run needs, the button that begins it, and what keeps it from that."""

    def __init__(self, tab: HomeTab):
        self.tab = tab
        self.usual, self.state = Shown(), Shown()
        with ui.element("section").classes("panel run-form").props('id="new-run" aria-label="New run"'):
            with ui.element("h2").classes("title"):
                ui.label(words.NEW_RUN)
            self._add_select("env", words.ENVIRONMENT, {id: id for id in tab.environments})
            self.objectives = ui.label().classes("explanation")
            self._add_select("preset", words.PRESET, {name: name for name in PRESETS})
            with ui.element("div").classes("run-numbers"):
                self.steps = self._add_input("steps", words.STEPS)
                self.seed = self._add_input("seed", words.SEED)
            self.ask = self._add_select("ask", words.ASK_LABEL, {"": "", **words.ASK})
            self.question = self._add_select("question", words.QUESTION_LABEL, {"": "", **words.QUESTION})
            self._add_input("name", words.FOLDER)
            with ui.expansion(words.MORE_SETTINGS, value=bool(tab.form.more)).props("dense").classes("more-settings"):
                more = ui.textarea(words.MORE_LABEL, value=tab.form.more, on_change=self._filling_in("more"))
                more.props("dense outlined autogrow spellcheck=false")
                ui.label(words.MORE_HINT).classes("explanation")
            with ui.element("div").props('role="alert"'):
                self.problems = ui.element("ul").classes("problems")
            self.begin = ui.button(words.BEGIN, on_click=tab.begin).props("no-caps color=primary").classes("begin")

    def show(self) -> None:
        """Show what the environment and the preset have where nothing is filled in, and what is wrong."""
        tab = self.tab
        if self.usual.is_new(tab.form.env, tab.form.preset):
            self._show_usual()
        if self.state.is_new(tab.problems, tab.at_work):
            self.begin.set_enabled(not tab.at_work)
            self.problems.clear()
            with self.problems:
                for problem in tab.problems:
                    with ui.element("li"):
                        ui.label(problem)
                if tab.problems:
                    ui.run_javascript(f"document.getElementById('{self.problems.html_id}').scrollIntoView(false)")

    def _show_usual(self) -> None:
        form, usual = self.tab.form, self.tab.form.usual()
        self.objectives.set_text(home_texts.objectives(self.tab.environments[form.env]))
        if usual:
            self.steps.props["placeholder"] = words.USUAL.format(value=short_count(usual.steps))
            self.seed.props["placeholder"] = words.USUAL.format(value=usual.seed)
            self.ask.set_options(_with_usual(words.ASK, usual.ask), value=form.ask)
            self.question.set_options(_with_usual(words.QUESTION, usual.question), value=form.question)

    def _add_select(self, field: str, label: str, options: Mapping[str, str]) -> ui.select:
        value, filling_in = getattr(self.tab.form, field), self._filling_in(field)
        return ui.select(dict(options), label=label, value=value, on_change=filling_in).props("dense outlined")

    def _add_input(self, field: str, label: str) -> ui.input:
        value, filling_in = getattr(self.tab.form, field), self._filling_in(field)
        return ui.input(label, value=value, on_change=filling_in).props("dense outlined stack-label")

    def _filling_in(self, field: str) -> Changed:
        return lambda event: self.tab.fill_in(**{field: event.value or ""})


def _with_usual(options: Mapping[str, str], usual: str) -> dict[str, str]:
    """Return the options, and before them none, which is what is usual."""
    return {"": words.USUAL.format(value=options[usual]), **options}
