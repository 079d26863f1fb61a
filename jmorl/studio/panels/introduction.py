"""The first sentences that somebody new reads, until they put them away for good."""

from nicegui import ui

from jmorl.display.questions import introduction
from jmorl.studio import texts, words
from jmorl.studio.tab import Tab

# The browser remembers who has read them; the page then never shows them, not even for a moment.
REMEMBER = (
    "() => { localStorage.setItem('jmorl-introduced', '1'); document.documentElement.classList.add('introduced') }"
)
REMEMBERED = """<script>
if (localStorage.getItem("jmorl-introduced")) document.documentElement.classList.add("introduced");
</script>"""


class Introduction:
    """What happens here, what is asked, and that nothing is final."""

    def __init__(self, tab: Tab):
        with ui.element("section").classes("bar introduction").props('aria-label="Introduction"'):
            watching, objectives = tab.access.watching, tab.view.objectives
            ui.label(texts.watched(objectives) if watching else introduction(objectives))
            ui.button(words.GOT_IT).props("no-caps dense flat").on("click", js_handler=REMEMBER)

    def show(self) -> None:
        """Do nothing: it does not change."""
