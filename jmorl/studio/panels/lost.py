"""What stands over the page while the studio does not answer, and switches everything else off."""

from nicegui import ui

from jmorl.studio import texts
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab

# The framework tells by its own message, which this one replaces. What is inert takes neither clicks nor keys.
SWITCHED_OFF = """<script>
addEventListener("DOMContentLoaded", () => {
  const theirs = document.getElementById("popup");
  const follow = () => {
    for (const page of document.querySelectorAll(".studio")) page.inert = theirs.ariaHidden === "false";
  };
  new MutationObserver(follow).observe(theirs, { attributes: true });
});
</script>"""


class Lost:
    """The message, which is there all the time and is seen only without a server: nobody could send it then."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.shown = Shown()
        with ui.element("div").classes("lost").props('role="alert"'):
            self.text = ui.label()

    def show(self) -> None:
        """Name the run that is open."""
        if self.shown.is_new(self.tab.view.path):
            self.text.set_text(texts.lost(self.tab.view))
