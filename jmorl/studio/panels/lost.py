"""What stands over the page while the studio does not answer, and switches everything else off."""

from collections.abc import Callable
from pathlib import Path

from nicegui import ui

from jmorl.studio import texts
from jmorl.studio.panels.panel import Shown

# The framework tells by its own message, which this one replaces. What is inert takes neither clicks nor keys.
SWITCHED_OFF = """<script>
addEventListener("DOMContentLoaded", () => {
  const theirs = document.getElementById("popup");
  const follow = () => {
    for (const page of document.querySelectorAll(".studio, .home")) page.inert = theirs.ariaHidden === "false";
  };
  new MutationObserver(follow).observe(theirs, { attributes: true });
});
</script>"""


class Lost:
    """The message, which is there all the time and is seen only without a server: nobody could send it then.

    `folder` returns the folder to start the studio with again.
    """

    def __init__(self, folder: Callable[[], Path]):
        self.folder = folder
        self.shown = Shown()
        with ui.element("div").classes("lost").props('role="alert"'):
            self.text = ui.label()

    def show(self) -> None:
        """Name the folder, which may be another one by now."""
        if self.shown.is_new(self.folder()):
            self.text.set_text(texts.lost(self.folder()))
