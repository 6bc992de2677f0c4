"""The page in headless Chromium, touched as people touch it."""

import contextlib
import re
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import pytest
from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement

from tests.panel.bench import PATIENCE_S, Bench, running

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and chromium-driver"),
]

EMERGENCY = 0x085
"""COB-ID of the node's emergencies."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """Yield an emulator on a bus that stock clients join."""
    layer = tmp_path_factory.mktemp("page") / "bus.toml"
    layer.write_text('[bus]\ninterface = "socketcand_server"\nchannel = "can0"\nport = 0\n')
    with running("--panel", bus=[str(layer)]) as started:
        yield started


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[webdriver.Chrome]:
    """Yield a browser that loads nothing by itself."""
    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for option in (
        "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
        "--disable-background-networking", "--disable-component-update", "--disable-sync",
        "--window-size=1300,1000", f"--user-data-dir={tmp_path_factory.mktemp('profile')}",
    ):  # fmt: skip
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(str(DRIVER)))
    yield driver
    driver.quit()


@pytest.fixture
def page(bench: Bench, browser: webdriver.Chrome) -> Iterator[webdriver.Chrome]:
    """Yield the panel's page; it must not complain."""
    browser.get("about:blank")
    browser.get(bench.url)
    until(lambda: browser.find_elements(By.ID, "tab-Faults"))
    yield browser
    assert [e for e in browser.get_log("browser") if e["level"] == "SEVERE"] == []


def until(condition: Callable[[], Any]) -> Any:
    """Return the first true result; elements that vanish meanwhile are searched again."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        with contextlib.suppress(StaleElementReferenceException):
            if result := condition():
                return result
        time.sleep(0.05)
    raise AssertionError("what was waited for did not come")


def shown(browser: webdriver.Chrome, css: str) -> list[WebElement]:
    """Return the elements that can be seen."""
    return [e for e in browser.find_elements(By.CSS_SELECTOR, css) if e.is_displayed()]


def click(browser: webdriver.Chrome, css: str, text: str = "") -> None:
    """Click the element that can be seen, with this text where several are."""
    until(lambda: [e for e in shown(browser, css) if not text or e.text == text])[0].click()


def emergency(bus: can.BusABC) -> str:
    """Return the code of the next emergency on the bus."""
    messages = iter(lambda: bus.recv(PATIENCE_S), None)
    return next(m.data[1::-1].hex() for m in messages if m.arbitration_id == EMERGENCY)


def test_a_fault_by_a_click_is_on_the_bus_and_gone_after_the_second(
    bench: Bench, page: webdriver.Chrome
) -> None:
    """A stock client sees the emergency of the broken sensor, and that it is over."""
    with can.Bus(
        interface="socketcand", host="127.0.0.1", port=bench.can_port, channel="can0"
    ) as bus:
        click(page, "#tab-Faults")
        click(page, "#tab [type=submit]")
        assert emergency(bus) == "ff10"
        line = until(lambda: shown(page, "#running li"))[0]
        assert line.text.startswith("pressure_a off")
        click(page, "#running button")
        assert emergency(bus) == "0000"
        until(lambda: not shown(page, "#running li"))


@pytest.mark.parametrize("typed", ["", "abc"])
def test_a_fault_without_a_number_is_refused(page: webdriver.Chrome, typed: str) -> None:
    """Nothing is injected; the message names the field and the usual value."""
    click(page, "#tab-Faults")
    click(page, ".kinds button", "offset")
    field = until(lambda: shown(page, "#p-value"))[0]
    usual = field.get_attribute("value")
    field.clear()
    field.send_keys(f"{typed}\n")
    words = f"value: write a number, such as {usual} bar. Nothing was injected."
    until(lambda: [e for e in shown(page, "#panel-Faults [role=alert]") if e.text == words])
    assert not shown(page, "#running li")


def test_a_set_point_that_no_longer_comes_is_stale(bench: Bench, page: webdriver.Chrome) -> None:
    """One second after its last frame, and then for how long it has been silent."""
    click(page, "#tab-Nodes")
    with can.Bus(
        interface="socketcand", host="127.0.0.1", port=bench.can_port, channel="can0"
    ) as bus:
        for _ in range(20):
            bus.send(can.Message(arbitration_id=0x205, data=bytes(4), is_extended_id=False))
            time.sleep(0.002)
    until(lambda: [e for e in shown(page, ".stale") if re.search("RPDO1 205 silent for", e.text)])
    click(page, "#tab-Bus")
    until(lambda: [e for e in shown(page, ".stale") if e.text.startswith("205 rx silent for")])


@pytest.mark.parametrize("name", ["Faults", "Settings", "Nodes", "Bus", "Scenarios", "Loop"])
def test_nothing_is_cut_off_on_a_phone(page: webdriver.Chrome, name: str) -> None:
    """At 390 px the page scrolls down only, and every button of a tab is on it."""
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        click(page, f"#tab-{name}")
        until(lambda: page.execute_script("return innerWidth") == 390)
        assert page.execute_script("return document.documentElement.scrollWidth") <= 390
        for button in shown(page, f"#panel-{name} button"):
            place = button.rect
            assert place["x"] >= 0
            assert place["x"] + place["width"] <= 390
    finally:
        page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_strips_fill_a_large_window(page: webdriver.Chrome) -> None:
    """They grow with the height of the window, and are all on it."""
    size = {"width": 2400, "height": 1300, "deviceScaleFactor": 1, "mobile": False}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        until(lambda: all(e.rect["height"] > 230 for e in shown(page, ".strip")))
        last = shown(page, ".strip")[-1].rect
        assert 1100 < last["y"] + last["height"] <= 1300
    finally:
        page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_a_screen_reader_finds_names_and_roles(page: webdriver.Chrome) -> None:
    """Every control has a name, every tab its panel, every strip a description."""
    nameless = page.execute_script("""
        return [...document.querySelectorAll("button, input, select")].filter((e) =>
          e.checkVisibility() && !(e.textContent.trim() || e.getAttribute("aria-label") ||
          e.labels?.length || e.title)).map((e) => e.outerHTML)""")
    assert nameless == []
    for tab in shown(page, "[role=tab]"):
        panel = page.find_element(By.ID, tab.get_attribute("aria-controls"))
        assert panel.get_attribute("aria-labelledby") == tab.get_attribute("id")
    strip = shown(page, ".strip [role=img]")[0]
    assert strip.get_attribute("aria-label") == "position, model.position over time, in mm"
    assert page.find_element(By.TAG_NAME, "h1").text == "hyq_knee + bus"


def test_a_set_point_out_of_bounds_is_refused_in_words(page: webdriver.Chrome) -> None:
    """The words are those of the command line; the bench stays as it is."""
    click(page, "#tab-Settings")
    field = until(lambda: shown(page, "[name=supply_pressure]"))[0]
    field.clear()
    field.send_keys("900\n")
    words = "supply_pressure: 900 bar is outside 1 bar ... 700 bar"
    refused = "[data-setting=supply_pressure] [role=alert]"
    until(lambda: [e for e in shown(page, refused) if e.text == words])


def test_the_keyboard_reaches_the_tabs_and_pauses(page: webdriver.Chrome) -> None:
    """Arrows go through the tabs, Space holds the strips, and they go on."""
    page.find_element(By.ID, "tab-Faults").click()
    page.switch_to.active_element.send_keys("\ue014")
    until(lambda: page.switch_to.active_element.get_attribute("id") == "tab-Settings")
    page.execute_script("document.activeElement.blur()")
    page.find_element(By.TAG_NAME, "body").send_keys(" ")
    until(lambda: page.find_element(By.ID, "pause").text == "Go on")
    click(page, "#pause")
    until(lambda: page.find_element(By.ID, "pause").text == "Pause")


def test_strips_move(page: webdriver.Chrome) -> None:
    """What is drawn is younger every time one looks, and values stand in the legend."""
    before = page.find_element(By.ID, "clock").text
    until(lambda: page.find_element(By.ID, "clock").text != before)
    values = until(
        lambda: [e.text for e in shown(page, ".legend output") if e.text not in ("", "–")]
    )
    assert len(values) >= 4


def test_a_page_without_the_token_says_where_to_get_it(
    bench: Bench, browser: webdriver.Chrome
) -> None:
    """It shows nothing of the bench."""
    browser.get("about:blank")
    browser.get(f"http://127.0.0.1:{bench.port}/")
    until(lambda: "open the address" in browser.find_element(By.ID, "notice").text)
    browser.get_log("browser")


def test_the_page_says_that_the_emulator_has_ended(
    tmp_path: Path, browser: webdriver.Chrome
) -> None:
    """What is on the strips stays."""
    with running("--panel", "--duration", "5 s") as short:
        browser.get("about:blank")
        browser.get(short.url)
        until(lambda: shown(browser, ".strip"))
        until(lambda: "has ended" in browser.find_element(By.ID, "notice").text)
        assert shown(browser, ".strip")
        assert short.process.wait(PATIENCE_S) == 0
