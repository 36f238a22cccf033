"""The report in a real browser: it opens without errors, its pictures are there, and it fits a phone."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Any

import pytest
from report_data import SMALL, all_played, experiment
from test_replay_browser import OPTIONS, wait_for

from swarmscope.viewing.report import write_report

WIDE = ("boxes_path_redundancy", "paths", "sweep_w_i", "field")


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    what = experiment(**SMALL)
    return write_report(what, all_played(what), tmp_path_factory.mktemp("report") / "out").resolve().as_uri()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    webdriver = pytest.importorskip("selenium.webdriver", reason="report in a browser: selenium is missing")
    from selenium.webdriver.chrome.service import Service

    binary, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if binary is None or driver is None:
        pytest.skip("the report is not tried in a browser: chromium or chromedriver is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for option in (*OPTIONS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    window = webdriver.Chrome(options=options, service=Service(driver))
    yield window
    window.quit()


@pytest.fixture
def page(browser: Any, address: str) -> Iterator[Any]:
    browser.get("about:blank")
    browser.get(address)
    wait_for(lambda: browser.execute_script("return document.readyState") == "complete")
    yield browser
    assert [entry for entry in browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")] == []


def ask(page: Any, expression: str, *arguments: Any) -> Any:
    return page.execute_script(f"return {expression}", *arguments)


def test_every_picture_is_there(page: Any):
    widths = ask(page, "Array.from(document.images, (image) => [image.naturalWidth, image.complete])")
    assert len(widths) >= len(WIDE)
    assert all(width > 0 and complete for width, complete in widths)
    assert set(WIDE) <= set(ask(page, "Array.from(document.querySelectorAll('figure'), (figure) => figure.id)"))


def test_nothing_is_asked_of_the_network(page: Any):
    requests = [entry["message"] for entry in page.get_log("performance") if "requestWillBeSent" in entry["message"]]
    assert requests
    assert not [message for message in requests if '"url":"http' in message]


@pytest.mark.parametrize("width", [340, 820, 1600])
def test_nothing_sticks_out_at_any_width(page: Any, width: int):
    size = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": False}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        wait_for(lambda: ask(page, "innerWidth") == width)
        assert ask(page, "document.documentElement.scrollWidth") <= width
        stretched = "Array.from(document.images, (i) => i.naturalHeight * i.width / i.naturalWidth / i.height)"
        assert ask(page, stretched) == pytest.approx([1.0] * ask(page, "document.images.length"), abs=0.02)
    finally:
        page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_links_lead_to_chapters_and_folds_open(page: Any):
    missing = "Array.from(document.querySelectorAll('nav a')).filter((a) => !document.querySelector(a.hash)).length"
    assert ask(page, missing) == 0
    fold = page.find_element("css selector", "details")
    assert not fold.find_element("tag name", "pre").is_displayed()
    fold.find_element("tag name", "summary").click()
    assert fold.find_element("tag name", "pre").is_displayed()


def corner(page: Any) -> list[int]:
    """Return the most frequent colour of the picture of the interaction force, as the page shows it."""
    import io
    from base64 import b64decode

    from PIL import Image

    image = page.find_element("css selector", "#field img")
    shown = Image.open(io.BytesIO(b64decode(image.screenshot_as_base64))).convert("RGB")
    return list(max(shown.getcolors(shown.width * shown.height) or [], key=lambda entry: entry[0])[1])  # type: ignore[arg-type]


def test_page_and_pictures_follow_the_dark_scheme(page: Any):
    background = "getComputedStyle(document.body).backgroundColor"
    assert ask(page, background) == "rgb(255, 255, 254)"
    light = corner(page)
    page.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    )
    try:
        assert ask(page, background) == "rgb(21, 25, 29)"
        assert min(light) > 200
        assert max(corner(page)) < 60
    finally:
        page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_print_is_light_whatever_the_scheme(page: Any):
    dark = [{"name": "prefers-color-scheme", "value": "dark"}]
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print", "features": dark})
    try:
        assert ask(page, "getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 254)"
    finally:
        page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
