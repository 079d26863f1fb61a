"""The dial between two policies that are laid out: what lies between them, at work, scored, and as a file."""

from nicegui import background_tasks, ui
from nicegui.events import GenericEventArguments

from jmorl.studio import texts, words
from jmorl.studio.between import BEYOND
from jmorl.studio.panels.panel import Shown
from jmorl.studio.panels.player import Player
from jmorl.studio.tab import Tab

STEP = 5  # per cent, of the dial


class BetweenPanel:
    """The dial, and the blend that it is at."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.shown = Shown()
        self.place: tuple[str, int, int] | None = None  # run and policies of the dial
        self.per_cent = 50
        with ui.element("div").classes("between"):
            self.hint = ui.label(words.BETWEEN_HINT).classes("explanation")
            with ui.element("div").classes("dial") as self.dial:
                with ui.element("div").classes("card-head"):
                    self.heading = ui.label().classes("card-title")
                    ui.button(icon="download", on_click=self._save).props(
                        'flat dense round size=sm aria-label="save the file of this blend"'
                    )
                # The browser's own, which keeps its keys to itself: those of the page move along the front.
                self.slider = ui.element("input").props(f"type=range min={-BEYOND} max={100 + BEYOND} step={STEP}")
                self.slider.props('aria-label="way from the first policy to the second, in per cent"')
                self.slider.on("input", self._moved, js_handler="(event) => emit(event.target.value)")
                self.player = Player()
                self.scores = ui.label().classes("between-scores")

    async def show_scores(self) -> None:
        """Score the blend that the dial is at; nothing where the dial has moved on by then."""
        at = self.place, self.per_cent
        if self.place is None:
            return
        score = await self.tab.score_between(*self.place, self.per_cent)
        if score is not None and at == (self.place, self.per_cent):
            self.scores.set_text(texts.blend_scores(self.tab.view, score, self.place[1:]))

    def show(self) -> None:
        """Show the dial of the first two policies that are laid out, while this panel is the one that is open."""
        tab = self.tab
        if not self.shown.is_new(tab.view, tab.selection, tab.side):
            return
        pair = tab.pair if tab.side == words.BETWEEN else None
        self.hint.set_visibility(pair is None)
        self.dial.set_visibility(pair is not None)
        place = (tab.view.run, *pair) if pair else None
        if place and place != self.place:
            self.place, self.per_cent = place, 50
            self.slider.props["value"] = self.per_cent
            self._play()
        elif place:
            self._name()

    def _moved(self, event: GenericEventArguments) -> None:
        """Follow the dial."""
        per_cent = int(event.args)
        if per_cent != self.per_cent:
            self.per_cent = per_cent
            self.slider.props["value"] = per_cent
            self._play()

    def _play(self) -> None:
        """Show the blend that the dial is at, and have it scored."""
        assert self.place is not None
        view = self.tab.view
        self._name()
        digits = texts.decimals(view)
        self.player.props["src"] = self._address
        self.player.props["objectives"] = [f"{each.label} so far" for each in view.objectives]
        self.player.props["decimals"] = [min(places if places is not None else 2, 4) for places in digits]
        self.player.props["label"] = "the blend at work"
        self.player.update()
        self.scores.set_text(words.SCORING)
        background_tasks.create(self.show_scores())

    def _name(self) -> None:
        """Say where the dial is; the letters of its policies may change."""
        assert self.place is not None
        self.heading.set_text(texts.blend_name(self.tab.selection, self.place[1:], self.per_cent))

    def _save(self) -> None:
        ui.download(f"{self._address}.npz")

    @property
    def _address(self) -> str:
        assert self.place is not None
        return f"/between/{'/'.join(map(str, self.place))}/{self.per_cent}"
