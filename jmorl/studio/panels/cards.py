"""The policies that are laid out: their behaviour, their scores, and what choosing them would mean."""

from nicegui import ui

from jmorl.search.policy import Policy
from jmorl.studio import texts, words
from jmorl.studio.panels.panel import Shown
from jmorl.studio.panels.player import Player
from jmorl.studio.selection import LETTERS
from jmorl.studio.tab import Tab


class Cards:
    """The places of the cards, one for each letter; a policy stays in its place while it is laid out."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.shown = Shown()
        self.cards: dict[str, Card] = {}
        with ui.element("section").classes("panel behaviour").props('aria-label="Behaviour"'):
            controls = Player()
            controls.props["controls"] = True
            self.hint = ui.label(words.LOOK_HINT).classes("hint")
            with ui.element("div").classes("cards"):
                self.places = {letter: ui.element("article").classes("place") for letter in LETTERS}

    def show(self) -> None:
        """Show the policies that are laid out. A card that is shown stays: it plays an episode."""
        view, selection = self.tab.view, self.tab.selection
        if not self.shown.is_new(view, selection):
            return
        for letter, place in self.places.items():
            policy = view.policy(selection.places[letter]) if letter in selection.places else None
            card = self.cards.get(letter)
            if card and (view.run != card.run or policy is not card.policy):  # it may have been scored anew
                place.clear()
                del self.cards[letter]
            if policy and letter not in self.cards:
                with place:
                    self.cards[letter] = Card(self.tab, policy, letter)
            if policy:
                self.cards[letter].show()
            focused = policy is not None and policy.id == selection.focus
            place.classes(add="focus" if focused else None, remove=None if focused else "focus")
            place.set_visibility(policy is not None)
        self.hint.set_visibility(not self.cards)


class Card:
    """The card of one policy."""

    def __init__(self, tab: Tab, policy: Policy, letter: str):
        self.tab = tab
        self.policy = policy
        self.letter = letter
        view = tab.view
        self.run = view.run
        with ui.element("div").classes("card-head"):
            ui.label(letter).classes(f"letter mark-{letter}")
            ui.label(f"policy {policy.id}").classes("card-title")
            self.star = ui.button(on_click=lambda: tab.favour(policy.id)).props(
                f'flat dense round size=xs aria-label="favourite: policy {policy.id}"'
            )
            self.edit = ui.button(on_click=lambda: tab.edit_policy(policy.id)).props(
                f'flat dense round size=xs aria-label="name and note of policy {policy.id}"'
            )
            address = f"/policies/{view.run}/{policy.id}.npz"
            if not view.early:
                ui.button(icon="download", on_click=lambda: ui.download(address)).props(
                    f'flat dense round size=xs aria-label="save the file of policy {policy.id}"'
                )
            ui.button(icon="close", on_click=lambda: tab.put_away(policy.id)).props(
                f'flat dense round size=xs aria-label="put policy {policy.id} away"'
            )
        self.name = ui.label().classes("given-name")
        self.standing = ui.label().classes("standing")
        player = Player()
        digits = texts.decimals(view)
        player.props["src"] = f"/{'early' if view.early else 'episodes'}/{view.run}/{policy.id}"
        player.props["objectives"] = [f"{each.label} so far" for each in view.objectives]
        player.props["decimals"] = [min(places if places is not None else 2, 4) for places in digits]
        player.props["label"] = f"policy {policy.id} at work"
        with ui.element("dl").classes("scores"):
            for score, objective in zip(texts.score_of_each(view, policy), view.objectives, strict=True):
                with ui.element("dt"):
                    ui.label(objective.label)
                with ui.element("dd"):
                    ui.label(score)
        if policy.raw is not None:
            ui.label(texts.raw_returns(view, policy)).classes("consequences")
        self.beside = ui.label().classes("consequences beside")
        self.remark = ui.label().classes("consequences")
        self.note = ui.label().classes("consequences note")
        with ui.element("div").classes("choice"):
            self.choose = ui.button(on_click=lambda: tab.choose(policy.id)).props("no-caps dense").classes("choose")

    def show(self) -> None:
        """Show what depends on the question and on the focus."""
        view, selection = self.tab.view, self.tab.selection
        focused = selection.focus == self.policy.id
        noted = view.noted.policy(self.policy.id)
        self.star.set_icon("star" if noted.favourite else "star_border")
        self.star.props(f"aria-pressed={str(noted.favourite).lower()}")
        for button in (self.star, self.edit):
            button.set_visibility(not self.tab.access.watching)
        self.edit.set_icon("edit_note" if noted.text else "edit")
        for label, text in ((self.name, noted.name), (self.note, noted.text)):
            label.set_text(text)
            label.set_visibility(bool(text))
        standing = texts.standing(view, self.policy)
        self.standing.set_text(standing)
        self.standing.set_visibility(bool(standing) or not noted.name)  # without either its line stays free
        self.beside.set_text(texts.beside(view, selection, self.policy))
        self.remark.set_text(texts.remark(view, self.policy))
        self.choose.set_visibility(view.choosable(self.policy.id) and not self.tab.access.watching)
        final = view.question is not None and view.question.purpose == "final"
        self.choose.set_text(f"{self.letter} is the result" if final else f"Choose {self.letter}")
        self.choose.props(remove="outline" if focused else "", add="" if focused else "outline")
