"""The replay page in a real browser: it plays, it answers to hands and keys, it tells the robots' numbers."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_run import make_fake_run

from swarmscope.viewing.memories.again import Memories, Moment
from swarmscope.viewing.replay import write_replay

OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1280,860",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_fake_run(tmp_path_factory.mktemp("replay") / "run", crashed=4)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    webdriver = pytest.importorskip("selenium.webdriver", reason="replay page in a browser: selenium is missing")
    from selenium.webdriver.chrome.service import Service

    binary, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if binary is None or driver is None:
        pytest.skip("the replay page is not tried in a browser: chromium or chromedriver is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for option in (*OPTIONS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    window = webdriver.Chrome(options=options, service=Service(driver))
    yield window
    window.quit()


@pytest.fixture
def page(browser: Any, folder: Path) -> Iterator[Any]:
    browser.get("about:blank")
    browser.get(write_replay(folder).as_uri())
    wait_for(lambda: browser.execute_script("return !!window.swarmscope"))
    yield browser
    severe = [entry for entry in browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
    assert severe == []


def wait_for(condition: Callable[[], Any], seconds: float = 20.0) -> Any:
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.03)
    return found


def ask(page: Any, expression: str, *arguments: Any) -> Any:
    return page.execute_script(f"return {expression}", *arguments)


def find(page: Any, name: str) -> Any:
    return page.find_element("id", name)


def seek(page: Any, seconds: float) -> None:
    script = "const s = document.getElementById('time'); s.value = arguments[0];"
    page.execute_script(script + "s.dispatchEvent(new Event('input', {bubbles: true}))", seconds)


def press(page: Any, key: str) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    ActionChains(page).send_keys(key).perform()


def click_at(page: Any, x: float, y: float) -> None:
    from selenium.webdriver.common.actions.action_builder import ActionBuilder

    builder = ActionBuilder(page)
    builder.pointer_action.move_to_location(round(x), round(y)).click()
    builder.perform()


def click_robot(page: Any, robot: int) -> None:
    spot = ask(page, "swarmscope.robotScreenPosition(arguments[0])", robot)
    click_at(page, spot["x"], spot["y"])
    wait_for(lambda: ask(page, "swarmscope.selected()") == robot)


def test_the_selected_robots_map_and_way_are_drawn(browser: Any, folder: Path) -> None:
    corner = np.array([[80.0, 0.0], [80.0, 40.0]])
    toggled = [np.array([[0, k, 20] for k in range(200)], np.int16), np.array([[1, 4, k] for k in range(9)], np.int16)]
    moments = [Moment(10 * k, 0, True, toggled[k], corner[: k + 1], (1.0, 1.0, 0.1)) for k in range(2)]
    browser.get("about:blank")
    browser.get(write_replay(folder, Memories(0.0625, moments)).as_uri())
    wait_for(lambda: ask(browser, "!!window.swarmscope"))
    seek(browser, 8.0)

    def picture() -> str:
        time.sleep(0.15)
        found: str = ask(browser, "document.getElementById('view').toDataURL()")
        return found

    browser.execute_script("swarmscope.select(0)")
    drawn = picture()
    find(browser, "show-memory").click()
    assert picture() != drawn
    find(browser, "show-memory").click()
    assert picture() == drawn
    seek(browser, 0.5)  # back in time: the first moment only
    assert picture() != drawn
    seek(browser, 8.0)
    assert picture() == drawn
    assert [entry for entry in browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")] == []


def test_play_and_pause(page: Any) -> None:
    assert ask(page, "swarmscope.time()") == 0.0
    find(page, "play").click()
    wait_for(lambda: ask(page, "swarmscope.time()") > 0.3)
    assert find(page, "play").get_attribute("aria-label") == "Pause"
    find(page, "play").click()
    still = ask(page, "swarmscope.time()")
    time.sleep(0.2)
    assert ask(page, "swarmscope.time()") == still
    assert find(page, "play").get_attribute("aria-pressed") == "false"


def test_playing_stops_at_the_end_and_starts_again(page: Any) -> None:
    page.execute_script("swarmscope.seek(23.4); swarmscope.play()")
    wait_for(lambda: find(page, "play").get_attribute("aria-pressed") == "false")
    assert ask(page, "swarmscope.time()") == pytest.approx(23.6)
    find(page, "play").click()
    wait_for(lambda: 0.0 < ask(page, "swarmscope.time()") < 5.0)


def test_slider_moves_robots_to_the_recorded_place(page: Any, folder: Path) -> None:
    before = ask(page, "swarmscope.robotScreenPosition(0)")
    seek(page, 8.0)
    after = ask(page, "swarmscope.robotScreenPosition(0)")
    assert after["x"] > before["x"] + 50
    with np.load(folder / "trajectory.npz") as recorded:
        x, y = recorded["x_m"], recorded["y_m"]
    spots = [ask(page, "swarmscope.robotScreenPosition(arguments[0])", i) for i in range(6)]
    scale = (spots[5]["x"] - spots[0]["x"], spots[0]["y"] - spots[5]["y"])
    metres = (x[20, 5] - x[20, 0], y[20, 5] - y[20, 0])
    assert scale[0] / scale[1] == pytest.approx(metres[0] / metres[1], abs=1e-3)


def test_positions_between_ticks_are_interpolated(page: Any) -> None:
    spots = []
    for moment in (4.0, 4.1, 4.4):
        seek(page, moment)
        spots.append(ask(page, "swarmscope.robotScreenPosition(0)")["x"])
    assert spots[1] == pytest.approx(spots[0] + 0.25 * (spots[2] - spots[0]), abs=0.01)


def test_arrays_reach_the_page_unchanged(page: Any, folder: Path) -> None:
    with np.load(folder / "trajectory.npz") as recorded:
        for name in ("x_m", "yaw_rad", "state", "side", "bytes_sent", "scan_u8", "safe_bits", "links", "p_left"):
            found = ask(page, "Array.from(swarmscope.data.arrays[arguments[0]], (v) => isNaN(v) ? null : v)", name)
            wanted = recorded[name].astype(np.float32 if recorded[name].dtype.kind == "f" else np.int64)
            as_floats = np.array(found, dtype=np.float64)
            np.testing.assert_array_equal(as_floats, wanted.ravel().astype(np.float64), err_msg=name)


def test_a_click_on_a_robot_tells_its_numbers_and_its_reason(page: Any, folder: Path) -> None:
    seek(page, 8.0)
    click_robot(page, 2)
    wait_for(lambda: "8.0 s" in find(page, "panel").text)
    text = find(page, "panel").text
    with np.load(folder / "trajectory.npz") as recorded:
        reason = str(recorded["reason_names"][recorded["reason"][20, 2]])
        state = str(recorded["state_names"][recorded["state"][20, 2]])
        rows = [
            f"{recorded['x_m'][20, 2]:.2f}, {recorded['y_m'][20, 2]:.2f} m",
            f"{recorded['speed_mps'][20, 2]:.2f} m/s",
            f"{recorded['bytes_sent'][20, 2]} bytes",
            f"{recorded['clearance_m'][20, 2]:.2f} m",
            f"{recorded['p_left'][20, 2]:.3f}",
        ]
    for words in (reason, state, *rows):
        assert words in text
    box = find(page, "view").rect
    click_at(page, box["x"] + 8, box["y"] + 8)
    wait_for(lambda: ask(page, "swarmscope.selected()") is None)
    wait_for(lambda: "Click a robot" in find(page, "panel").text)


def test_the_panel_follows_time(page: Any) -> None:
    page.execute_script("swarmscope.select(4)")
    seek(page, 2.0)
    wait_for(lambda: "2.0 s" in find(page, "panel").text)
    assert "crashed" not in find(page, "panel").text
    seek(page, 20.0)
    wait_for(lambda: "touched an obstacle" in find(page, "panel").text)


def test_keys(page: Any) -> None:
    from selenium.webdriver.common.keys import Keys

    press(page, Keys.ARROW_RIGHT)
    assert ask(page, "swarmscope.time()") == pytest.approx(0.4)
    press(page, Keys.END)
    assert ask(page, "swarmscope.time()") == pytest.approx(23.6)
    press(page, Keys.ARROW_LEFT)
    assert ask(page, "swarmscope.time()") == pytest.approx(23.2)
    press(page, Keys.HOME)
    press(page, "n")
    assert ask(page, "swarmscope.selected()") == 0
    press(page, Keys.ESCAPE)
    assert ask(page, "swarmscope.selected()") is None
    press(page, " ")
    wait_for(lambda: ask(page, "swarmscope.time()") > 0.1)
    press(page, " ")
    assert find(page, "play").get_attribute("aria-pressed") == "false"


def test_space_on_the_play_button_toggles_once(page: Any) -> None:
    page.execute_script("document.getElementById('play').focus()")
    press(page, " ")
    wait_for(lambda: ask(page, "swarmscope.time()") > 0.1)
    assert find(page, "play").get_attribute("aria-pressed") == "true"


def test_zoom_and_fit(page: Any) -> None:
    fitted = ask(page, "swarmscope.robotScreenPosition(0)")
    find(page, "zoom-in").click()
    assert ask(page, "swarmscope.robotScreenPosition(0)")["x"] < fitted["x"] - 20
    find(page, "fit").click()
    assert ask(page, "swarmscope.robotScreenPosition(0)") == pytest.approx(fitted)


def pixels(page: Any) -> str:
    script = "requestAnimationFrame(() => requestAnimationFrame(() => arguments[0]("
    return str(page.execute_async_script(script + "document.getElementById('view').toDataURL())))"))


def test_toggles_change_the_picture(page: Any) -> None:
    seek(page, 8.0)
    plain = pixels(page)
    for name in ("show-trails", "show-ids", "show-scans", "show-safe"):
        find(page, name).click()
        assert pixels(page) != plain, name
        find(page, name).click()
        assert pixels(page) == plain, name


def test_messages_are_drawn_when_they_flow(page: Any, folder: Path) -> None:
    with np.load(folder / "trajectory.npz") as recorded:
        sent_s = float(recorded["t_s"][recorded["links"][0, 0]])
    for moment, differs in ((sent_s + 0.1, True), (sent_s - 0.1, False)):
        seek(page, moment)
        shown = pixels(page)
        find(page, "show-links").click()
        assert (pixels(page) != shown) == differs
        find(page, "show-links").click()


def test_words_beside_a_robot_stand_one_below_the_other(page: Any, folder: Path) -> None:
    """What it chose, and what it said to others who chose at the same time."""
    with np.load(folder / "trajectory.npz") as recorded:
        choices, t_s = recorded["choices"], recorded["t_s"]
    page.execute_script(
        "window.words = []; const fill = CanvasRenderingContext2D.prototype.fillText;"
        "CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {"
        "if (/^(chose )?(left|right)/.test(text)) words.push([x, y]); fill.call(this, text, x, y); };"
    )
    pairs = 0
    for row in np.flatnonzero(choices[:, 5] >= 1)[:60]:
        page.execute_script("swarmscope.select(arguments[0])", int(choices[row, 1]))
        pixels(page)  # it is drawn
        page.execute_script("words.length = 0")
        seek(page, float(t_s[int(choices[row, 0])]) + 0.1)
        pixels(page)
        places = sorted({(round(x, 2), round(y, 2)) for x, y in ask(page, "words")})
        for (x, y), (other_x, other_y) in pairwise(places):
            if x == other_x and abs(y - other_y) < 40.0:
                pairs += 1
                assert abs(y - other_y) > 10.0
    assert pairs > 0


def test_who_said_what_when_a_side_was_chosen(page: Any, folder: Path) -> None:
    """The panel lists own opinion, those heard and the sum; lines are drawn for a moment; C goes to the next choice."""
    with np.load(folder / "trajectory.npz") as recorded:
        choices, opinions, t_s = recorded["choices"], recorded["opinions"], recorded["t_s"]
    row = int(np.flatnonzero(choices[:, 5] >= 2)[0])
    tick, robot, _, p_left, side, _ = choices[row]
    at_s = float(t_s[int(tick)])
    page.execute_script("swarmscope.select(arguments[0])", int(robot))
    seek(page, at_s + 0.1)
    wait_for(lambda: f"Chose {'left' if side > 0 else 'right'} at {at_s:.1f} s" in find(page, "panel").text)
    lines = find(page, "panel").find_element("class name", "votes").text.splitlines()
    wanted = ["itself 0.500"]
    for _, heard, where, p, weight in opinions[opinions[:, 0] == row]:
        wanted.append(f"robot {heard:.0f} {'left' if where > 0 else 'right'} {p:.3f} {weight:.3f}")
    assert lines[2:] == [*wanted, f"together {p_left:.3f}"]
    shown = pixels(page)
    find(page, "show-votes").click()
    assert pixels(page) != shown
    find(page, "show-votes").click()
    mine = sorted(t_s[choices[choices[:, 1] == robot, 0].astype(int)])
    page.execute_script("document.activeElement.blur(); swarmscope.seek(0)")
    press(page, "c")
    first = next(t for t in mine if t > 0.0)
    assert ask(page, "swarmscope.time()") == pytest.approx(first)


@pytest.mark.parametrize("width", [340, 700, 1600])
def test_nothing_sticks_out_at_any_width(page: Any, width: int) -> None:
    size = {"width": width, "height": 800, "deviceScaleFactor": 2, "mobile": False}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        wait_for(lambda: ask(page, "document.getElementById('view').width > 0 && innerWidth == arguments[0]", width))
        assert ask(page, "document.documentElement.scrollWidth") <= width
        drawn = "document.getElementById('view').width / document.getElementById('view').clientWidth"
        wait_for(lambda: ask(page, drawn) == pytest.approx(2.0, abs=0.02))
        for i in range(6):
            spot = ask(page, "swarmscope.robotScreenPosition(arguments[0])", i)
            assert 0 < spot["x"] < width
    finally:
        page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_dark_scheme_changes_colours(page: Any) -> None:
    light = pixels(page)
    scheme = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", scheme)
    assert pixels(page) != light
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_address_opens_a_moment(browser: Any, folder: Path) -> None:
    browser.get("about:blank")
    browser.get(write_replay(folder).as_uri() + "#t=6.5&robot=3")
    assert ask(browser, "[swarmscope.time(), swarmscope.selected()]") == [6.5, 3]


def test_run_without_scans_opens(browser: Any, tmp_path: Path) -> None:
    bare = make_fake_run(tmp_path / "bare", robots=2, ticks=1, scans=False)
    browser.get(write_replay(bare).as_uri() + "#robot=0")
    assert not find(browser, "show-scans").is_enabled()
    wait_for(lambda: "Position" in find(browser, "panel").text)
    find(browser, "play").click()
    wait_for(lambda: find(browser, "play").get_attribute("aria-pressed") == "false")
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
