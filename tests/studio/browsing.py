"""A tab of a real browser, and what a person does in it."""

import os
import re
from contextlib import contextmanager
from pathlib import Path

CHROMIUM = "/usr/bin/chromium"
FLAGS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
)
PATIENCE = 400_000  # milliseconds


@contextmanager
def chromium():
    """Start Debian's browser, without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


class Tab:
    """One tab on the studio. What goes wrong in it, or leaves this machine, is noted."""

    def __init__(self, browser, address, start=None):
        self.page = browser.new_page(viewport={"width": 1280, "height": 720}, reduced_motion="no-preference")
        self.page.set_default_timeout(PATIENCE)
        self.problems = []
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on("request", self._note_request)
        self.address = address
        self.page.goto(start or address)

    def _note_request(self, request):
        if not request.url.startswith((self.address, self.address.replace("http", "ws"), "data:", "blob:")):
            self.problems.append(f"asked for {request.url}")

    def lost(self):
        """Note that this page is about to lose its server."""
        self.page.evaluate("window.lost = true")

    def found_again(self):
        """Wait until the page has by itself made way for one that the server knows."""
        self.page.wait_for_function("!window.lost && window.did_handshake")

    def asked(self, generation):
        """Wait until the question before this generation is open."""
        self.page.get_by_text(f"Round {generation}: which of these").wait_for()

    def final(self):
        self.page.get_by_text("The run is over. Which of these").wait_for()

    def rows(self):
        return self.page.locator(".policies-row")

    def policies(self):
        """Return the numbers of the policies in the table, from the top."""
        return self.page.locator(".policies-row > span:nth-child(2)").all_inner_texts()

    def value(self, row):
        """Return the first objective of a row."""
        return float(self.rows().nth(row).locator("span").nth(2).inner_text().split()[0].replace("−", "-"))

    def drift(self):
        """Return how many pixels the chart of marks puts a point beside the place that the chart below gives it."""
        return self.page.evaluate(
            """() => {
              const [below, marks] = [...document.querySelectorAll(".front .nicegui-echart")].map(
                (each) => getElement(each.id.slice(1)).chart);
              const point = below.getOption().series.find((each) => each.id === "within the bounds").data[0];
              const [a, b] = [below, marks].map((chart) =>
                chart.convertToPixel({ xAxisIndex: 0, yAxisIndex: 0 }, [point[1], point[2]]));
              const [p, q] = [below, marks].map((chart) => chart.getDom().getBoundingClientRect());
              return Math.hypot(a[0] + p.x - b[0] - q.x, a[1] + p.y - b[1] - q.y);
            }"""
        )

    def better_in(self, objective):
        """Return the button that shows only what is better in an objective."""
        return self.page.locator(".question").get_by_role("button", name=objective, exact=True)

    def put_all_away(self):
        """Put away what is laid out."""
        away = self.page.get_by_role("button", name=re.compile("put policy .* away"))
        while count := away.count():
            away.first.click()
            self.page.wait_for_function("(n) => document.querySelectorAll('.choose').length < n", arg=count)

    def to_the_top(self):
        """Scroll the table to its first row."""
        self.page.locator(".policies").evaluate("(table) => (table.scrollTop = 0)")
        self.page.locator('.policies-row[aria-rowindex="2"]').wait_for()

    def look_at(self, row):
        """Click a row of the table. Return the number of its policy when its card is there."""
        cell = self.rows().nth(row)
        policy = int(cell.locator("span").nth(1).inner_text())
        cell.click()
        self.page.locator(".place.focus .card-title", has_text=f"policy {policy}").wait_for()
        return policy

    def card(self, policy):
        return self.page.locator(".place", has=self.page.get_by_text(f"policy {policy}", exact=True))

    def choose(self, row=0):
        """Choose the policy of a row. Return its number."""
        policy = self.look_at(row)
        self.card(policy).get_by_role("button", name="Choose").click()
        return policy

    def end(self, policy):
        """Confirm that the run ends with a policy, which the dialog names."""
        self.page.get_by_role("button", name=f"policy {policy}:").click()

    def far_out(self):
        """Return the numbers of the policies at the edge of the chart."""
        return self.page.evaluate(
            """() => getElement(document.querySelector(".front .nicegui-echart").id.slice(1)).chart.getOption()
              .series.find((each) => each.id === "far out").data.map((each) => each.value[0])"""
        )

    def tab(self, name):
        self.page.get_by_role("tab", name=name).click()

    def bounds(self):
        """Return the lower corner of the shaded region in the chart, in the objectives' units, or None."""
        return self.page.evaluate(
            """() => {
              const area = chartOf(".front").getOption().series.find((each) => each.id === "bounds").markArea.data;
              return area.length ? area[0][0].coord : null;
              function chartOf(place) {
                const id = document.querySelector(`${place} .nicegui-echart`).id;
                return getElement(id.slice(1)).chart;
              }
            }"""
        )

    def pictures_differ(self, policy):
        """Wait until the canvas of a card has moved."""
        canvas = self.card(policy).locator("canvas")
        first = canvas.evaluate("(canvas) => canvas.toDataURL()")
        self.page.wait_for_function(
            "([canvas, first]) => canvas.toDataURL() !== first", arg=[canvas.element_handle(), first]
        )
        return True

    def barriers(self, dialog=False):
        """Return what axe-core finds that keeps people out: rules broken, with an element that breaks each.

        Of a dialog it takes the dimmed page for the ground, so that its contrasts are not judged; nor are those of one
        that is just fading away.
        """
        from axe_playwright_python.sync_playwright import Axe

        if not dialog:
            self.page.wait_for_function("!document.querySelector('.q-dialog')")
        options = {"rules": {"color-contrast": {"enabled": False}}} if dialog else None
        found = Axe().run(self.page, context=".q-card" if dialog else None, options=options).response["violations"]
        worst = [each for each in found if each["impact"] in ("serious", "critical")]
        return [(each["id"], each["nodes"][0]["html"][:200]) for each in worst]

    def screenshot(self, name):
        """Keep a picture, if a place for pictures is named."""
        place = os.environ.get("STUDIO_SCREENSHOTS")
        if place:
            self.page.wait_for_timeout(600)  # a ripple of the last click
            self.page.mouse.move(1, 1)
            self.page.screenshot(path=Path(place) / f"{name}.png")
