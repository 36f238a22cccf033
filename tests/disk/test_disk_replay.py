"""The replay page of the unit disk: what it holds, that names cannot do harm, and that it plays in a browser."""

import base64
import json
import re
import shutil
import time

import numpy as np
import pytest

from swarmscope.disk import bounds, controllers, maps, rules, runs
from swarmscope.disk.study import replay

OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking")


def page(names=("report",), title="one-disc", n=5):
    one = maps.DiskMap(title, maps.NAMED["one-disc"].obstacles)
    of = runs.problem(rules.scaled(n), [one], [tuple(range(n))[::-1]])
    shown = []
    for name in names:
        kind, film = controllers.find(name), runs.Film(7, [])
        shown.append(replay.Shown(name, runs.play(of, kind.create(of, kind.params), film), film))
    return of, shown, replay.replay_page(of, shown, int(bounds.bound(of)[0]))


def data_of(text):
    return json.loads(re.search(r'type="application/json">(.*?)</script>', text, re.DOTALL)[1])


def test_places_are_stored_to_a_thirty_thousandth():
    _, shown, text = page()
    data = data_of(text)
    whole = np.frombuffer(base64.b64decode(data["runs"][0]["places"]), dtype="<i2")
    places = whole.reshape(data["runs"][0]["frames"], 5, 2) / data["units"]
    exact = np.array([one[0] for one in shown[0].film.positions])
    assert np.abs(places - exact).max() <= 0.5 / replay.UNITS + 1e-12
    assert data["runs"][0]["steps"] == shown[0].outcome.steps[0]
    assert text == page()[2]


def test_nothing_is_fetched_and_names_cannot_do_harm():
    _, _, text = page(title="</script><script>alert(1)</script>")
    assert "<script>alert" not in text
    assert data_of(text)["map"] == "</script><script>alert(1)</script>"
    assert not re.search(r"(src|href)=.https?:", text)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is missing")
    from selenium.webdriver.chrome.service import Service

    binary, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if binary is None or driver is None:
        pytest.skip("chromium or chromedriver is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for option in (*OPTIONS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    window = webdriver.Chrome(options=options, service=Service(driver))
    yield window
    window.quit()


def test_it_plays_seeks_and_shows_all_controllers(browser, tmp_path):
    of, shown, text = page(("report", "reactive"))
    file = tmp_path / "replay.html"
    file.write_text(text, encoding="utf-8")
    browser.get(file.as_uri())
    labels = [one.text for one in browser.find_elements("css selector", "h2")]
    assert labels == ["report", "reactive"]
    state = "return window.swarmscope.state()"
    until = time.monotonic() + 20
    while browser.execute_script(state)["now"] <= 0 and time.monotonic() < until:
        time.sleep(0.05)
    assert browser.execute_script(state)["now"] > 0  # it plays by itself
    browser.find_element("id", "play").click()
    assert browser.execute_script(state)["playing"] is False
    browser.execute_script("window.swarmscope.seek(1e9)")
    ends = browser.execute_script(state)
    assert ends["now"] == ends["last"] == max(int(one.outcome.steps[0]) for one in shown)
    arrived = [one.text for one in browser.find_elements("css selector", "dd:first-of-type")]
    assert arrived == ["5 of 5", "5 of 5"]
    browser.execute_script("window.swarmscope.seek(0)")
    gap = float(browser.find_elements("css selector", "dd")[1].text)
    assert gap == pytest.approx(rules.spacing(5, 1.0) - 2 * of.rules.r, abs=2e-4)
    severe = [entry for entry in browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
    assert severe == []
