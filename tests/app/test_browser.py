"""The questionnaire in Chromium, as people use it: keys, mouse, reload, a lost connection, windows
of every size.
"""

import hashlib
import io
import itertools
import json
import re
import shutil
import tomllib

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect, sync_playwright
from sqlalchemy import select

from app import accounts, create_app, notes
from app.models import Participant, Response, Trial
from app.server import running
from app.simulation.client import forms
from stimuli.study import THESIS

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
KEY_OF = {-2: "1", -1: "2", 0: "3", 1: "4", 2: "5"}


def chromium_path():
    names = ("chromium", "chromium-browser", "google-chrome")
    path = next(filter(None, map(shutil.which, names)), None)
    assert path, "Chromium is missing; `make setup` installs it"
    return path


@pytest.fixture(scope="module")
def chromium():
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def study_dir(tmp_path_factory, write_study):
    """One for most tests, so that its pictures are resampled once for each size of window."""
    return write_study(tmp_path_factory.mktemp("browser") / "study", size=(960, 540))


@pytest.fixture(scope="module")
def short_study(tmp_path_factory, write_study):
    """One of twelve questions."""
    folder = tmp_path_factory.mktemp("browser") / "short"
    return write_study(folder, size=(960, 540), assignment={"pairs": 12})


@pytest.fixture
def database_url(fresh):
    return fresh()


@pytest.fixture
def fresh(tmp_path):
    """URLs of new databases: studies are shared, answers are each test's own."""
    numbers = itertools.count()
    return lambda: f"sqlite:///{tmp_path}/{next(numbers)}.sqlite3"


@pytest.fixture
def address(app):
    with running(app) as address:
        yield address


@pytest.fixture
def page(chromium):
    """A page on a desktop screen; whatever its console complains about fails the test."""
    with chromium.new_context(viewport={"width": 1280, "height": 720}) as context:
        page = context.new_page()
        page.set_default_timeout(20_000)
        complaints = []
        page.on(
            "console",
            lambda message: (
                message.type in ("error", "warning") and complaints.append(message.text)
            ),
        )
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.expected = ["Failed to load resource: net::"]  # requests that a test cuts
        yield page
        assert [
            text for text in complaints if not any(known in text for known in page.expected)
        ] == []


def begin(page, address):
    """At the first question; the pages before it are sent off without being drawn."""
    http = page.request  # with the cookies of the page
    token = forms(http.get(address).text())[0].fields["csrf_token"]
    http.post(address, form={"csrf_token": token, "consent": "yes"})
    http.post(f"{address}familiarity", form={"csrf_token": token, "familiarity": "3"})
    page.goto(f"{address}question")
    shown(page, 1)


def walk_in(page, address):
    """The same, page by page."""
    page.goto(address)
    page.check("[name=consent]")
    page.click("text=Begin")
    page.get_by_label("Some familiarity").check()
    page.click("text=Continue")
    shown(page, 1)


def shown(page, number):
    """Wait until a question and both its images are there to be answered."""
    expect(page.locator("h1")).to_have_text(re.compile(rf"Question {number}\s"))
    page.wait_for_selector("main.shown fieldset:enabled")


def unsent(page):
    return page.evaluate("Object.keys(localStorage).filter((key) => key.includes('unsent'))")


def stored(app):
    with app.extensions["database"].read() as db:
        return db.execute(select(Trial, Response).join(Response).order_by(Response.id)).all()


def test_all_answers_by_keyboard_and_mouse_with_a_reload_and_a_lost_connection(
    page, short_study, fresh
):
    app = create_app(short_study, fresh())
    with running(app) as address:
        answer_all(page, address)
    rows = stored(app)
    assert [trial.order for trial, _ in rows] == list(range(1, 13))
    assert [response.answer for _, response in rows] == ANSWERS
    assert {response.timed_by for _, response in rows} == {"browser"}
    assert {(r.viewport_width, r.viewport_height, r.device_pixel_ratio) for _, r in rows} == {
        (1280, 720, 1.0)
    }
    assert all(
        abs(r.shown_width / r.shown_height - 16 / 9) < 0.01 and r.shown_width > 600 for _, r in rows
    )
    assert [trial.order for trial, r in rows if r.times_shown > 1] == [5]
    assert page.evaluate("Object.keys(localStorage)") == []  # nothing of anybody stays


ANSWERS = [(7 * i) % 5 - 2 for i in range(12)]


def answer_all(page, address):
    walk_in(page, address)
    for number, answer in enumerate(ANSWERS, start=1):
        shown(page, number)
        if number == 5:  # a choice that is not confirmed is no answer
            page.keyboard.press("1")
            page.reload()
            shown(page, 5)
            assert page.locator("input[name=answer]:checked").count() == 0
        if number == 8:
            lose_connection_while_answering(page, answer)
        elif number % 2:
            page.keyboard.press(KEY_OF[answer])
            page.keyboard.press("Enter")
        else:
            page.click(f"label:has(input[name=answer][value='{answer}'])")
            page.click("button:text('Confirm')")
    expect(page.locator("#completion-code")).to_have_text(re.compile("^[A-Z2-9]{10}$"))


def lose_connection_while_answering(page, answer):
    page.context.set_offline(True)
    page.keyboard.press(KEY_OF[answer])
    page.keyboard.press("Enter")
    expect(page.locator(".status")).to_have_text("Not saved yet, trying again …")
    page.keyboard.press("Enter")  # impatience
    page.wait_for_timeout(1500)
    expect(page.locator("h1")).to_have_text(re.compile(r"Question 8\s"))
    page.context.set_offline(False)
    shown(page, 9)


def test_a_page_closed_without_a_connection_sends_its_answer_when_it_is_opened_again(
    page, address, app
):
    begin(page, address)
    page.context.set_offline(True)
    page.keyboard.press("5")
    page.keyboard.press("Enter")
    expect(page.locator(".status")).to_have_text("Not saved yet, trying again …")
    context = page.context
    page.close()
    assert stored(app) == []
    context.set_offline(False)
    again = context.new_page()
    again.goto(f"{address}question")
    shown(again, 2)
    ((_, response),) = stored(app)
    assert response.answer == 2 and not unsent(again)


def test_an_answer_whose_acknowledgement_was_lost_is_one_answer(page, address, app):
    begin(page, address)
    cut = []

    def lose_the_reply(route):
        if route.request.method == "POST" and not cut:
            cut.append(route.fetch().status)  # the server has it; the page never hears of it
            route.abort()
        else:
            route.continue_()

    page.route("**/question", lose_the_reply)
    page.keyboard.press("4")
    page.keyboard.press("Enter")
    shown(page, 2)
    assert cut == [200] and [r.answer for _, r in stored(app)] == [1]


def test_cleared_cookies_cost_no_answer_and_another_tab_is_told(page, address, app):
    page.expected.append("the server responded with a status of 400")
    begin(page, address)
    page.context.clear_cookies()
    page.keyboard.press("4")
    page.keyboard.press("Enter")
    shown(page, 2)
    second = page.context.new_page()
    second.goto(f"{address}question")
    shown(second, 2)
    for tab, key in ((page, "5"), (second, "1")):
        tab.keyboard.press(key)
        tab.keyboard.press("Enter")
        shown(tab, 3)
    expect(second.locator(".notice")).to_contain_text("the first answer was kept")
    expect(page.locator(".notice")).to_be_hidden()
    assert [r.answer for _, r in stored(app)] == [1, 2]
    page.context.clear_cookies()
    page.goto(address)
    page.click("text=Go on there")
    page.click("button:text('Go on')")
    shown(page, 3)


def test_back_and_double_click_change_nothing(page, address, app):
    begin(page, address)
    page.keyboard.press("2")
    page.dblclick("button:text('Confirm')")
    shown(page, 2)
    page.keyboard.press("1")
    page.keyboard.press("Enter")
    shown(page, 3)
    page.go_back()
    page.wait_for_load_state()
    page.goto(f"{address}question")
    shown(page, 3)
    assert [r.answer for _, r in stored(app)] == [-1, -2]


def test_arrows_and_focus(page, address):
    begin(page, address)
    page.keyboard.press("ArrowRight")  # from nothing: a step to the side, not 'no difference'
    expect(page.get_by_label("B, slightly")).to_be_checked()
    expect(page.get_by_label("B, slightly")).to_be_focused()
    assert (
        page.evaluate("getComputedStyle(document.activeElement.closest('label')).outlineWidth")
        == "3px"
    )
    assert page.get_by_role("group", name="Which image looks more realistic?").count() == 1
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")
    expect(page.get_by_label("A, slightly")).to_be_checked()
    azerty = "{key: '(', code: 'Digit5', bubbles: true}"  # the key of 5 without Shift
    page.evaluate(f"document.dispatchEvent(new KeyboardEvent('keydown', {azerty}))")
    expect(page.get_by_label("B, clearly")).to_be_checked()


def test_nothing_can_be_answered_before_both_images_are_there(page, address, app):
    held = {}
    page.route("**/images/**", lambda route: held.setdefault(route.request.url, route))
    page.goto(address)
    page.check("[name=consent]")
    page.click("text=Begin")
    page.get_by_label("Some familiarity").check()
    page.click("text=Continue")
    page.wait_for_selector("html.ready fieldset:disabled")
    expect(page.locator(".wait")).to_be_visible()
    page.keyboard.press("5")
    page.keyboard.press("Enter")
    second = json.loads(page.locator("main").get_attribute("data-images"))[1]["address"]
    page.wait_for_timeout(300)
    last = [held.pop(url) for url in list(held) if second in url]
    assert last
    for route in held.values():
        route.continue_()
    page.wait_for_timeout(300)
    expect(page.locator(".wait")).to_be_visible()
    assert page.locator("main.shown").count() == 0
    for route in last:
        route.continue_()
    page.unroute("**/images/**")
    shown(page, 1)
    expect(page.locator(".wait")).to_be_hidden()
    assert page.locator("input[name=answer]:checked").count() == 0 and stored(app) == []


def test_images_are_there_before_they_are_asked_for(page, address, app):
    """From the consent page on, and none comes over the network twice."""
    sent, inner = [], app.wsgi_app

    def counting(environ, start_response):
        sent.append(environ["PATH_INFO"])
        return inner(environ, start_response)

    app.wsgi_app = counting
    page.goto(address)
    page.wait_for_load_state("networkidle")
    page.check("[name=consent]")
    page.click("text=Begin")
    page.get_by_label("Some familiarity").check()
    page.wait_for_load_state("networkidle")  # a page that is left drops what it waits for
    page.click("text=Continue")
    upcoming = []
    for number in (1, 2, 3):
        shown(page, number)
        images = json.loads(page.locator("main").get_attribute("data-images"))
        assert number == 1 or all(image in upcoming for image in images)
        upcoming = json.loads(page.locator("main").get_attribute("data-upcoming"))
        page.wait_for_timeout(300)
        page.keyboard.press("3")
        page.keyboard.press("Enter")
    images = [path for path in sent if path.startswith("/images/")]
    assert 10 <= len(images) == len(set(images)) <= 15


def test_without_scripts_the_whole_questionnaire_works(chromium, short_study, fresh):
    app = create_app(short_study, fresh())
    with (
        running(app) as address,
        chromium.new_context(
            java_script_enabled=False, viewport={"width": 1280, "height": 720}
        ) as context,
    ):
        page = context.new_page()
        page.goto(address)
        page.check("[name=consent]")
        page.click("text=Begin")
        page.get_by_label("Some familiarity").check()
        page.click("text=Continue")
        for number in range(1, 13):
            expect(page.locator("h1")).to_have_text(re.compile(rf"Question {number}\s"))
            page.get_by_label("A, slightly").check()
            page.click("button:text('Confirm')")
        expect(page.locator("#completion-code")).to_be_visible()
    assert [r.answer for _, r in stored(app)] == [-1] * 12


def test_images_are_as_large_as_the_window_allows(page, address):
    """960 x 540 is 1920 x 1080 at 200 % zoom; phones stand and lie."""
    begin(page, address)
    for width, height, beside in (
        (1920, 1080, True),
        (1280, 720, True),
        (960, 540, True),
        (640, 360, True),
        (844, 390, True),
        (390, 844, False),
        (390, 660, False),
        (768, 1024, False),
    ):
        page.set_viewport_size({"width": width, "height": height})
        page.reload()
        shown(page, 1)
        a, b = (page.locator(".pair canvas").nth(i).bounding_box() for i in (0, 1))
        assert (a["y"] == b["y"]) == beside and (a["x"] == b["x"]) != beside
        assert a["width"] == b["width"] and abs(a["width"] / a["height"] - 16 / 9) < 0.02
        room = page.locator(".pair").bounding_box()
        across, down = (width / 2, room["height"]) if beside else (width, room["height"] / 2)
        # but for the gap, the labels, and the steps of 16 pixels
        assert a["width"] > min(across - 8, (down - 28) * 16 / 9) - 16, (width, height)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert page.evaluate("document.documentElement.scrollHeight <= innerHeight + 1")
        for label in page.locator(".options label").all():
            assert label.evaluate(
                "(l) => l.scrollWidth <= l.clientWidth && l.getBoundingClientRect().height >= 40"
            )


@pytest.mark.parametrize(
    ("width", "height", "ratio"),
    [(1281, 723, 1), (1707, 961, 1.1), (1366, 768, 1.25), (390, 844, 3), (412, 915, 2.625)],
)
def test_one_file_is_drawn_alike_on_both_sides(noise_study, chromium, width, height, ratio):
    """Byte for byte on the screen, in every view, at every window and pixel ratio, side by side and
    one above the other; and the screen shows the pixels of the file, scaled by nobody: 1:1 those of
    its region, 2:1 each as two by two, fitted those of the server's one resampling. The ratio is
    the browser's own: that of an emulated screen scales what was drawn at 1.
    """
    flags = [f"--force-device-scale-factor={ratio}", f"--window-size={width},{height}"]
    launch = chromium.browser_type.launch
    triplets = noise_study(modes=["triplet"], reference="none")
    boosted = noise_study(modes=["boosted"], reference="none", boost={"zoom": 3})
    noise = NOISE[108:432, 96:864]  # of the region [0.1, 0.2, 0.9, 0.8]
    with (
        running(noise_study()) as address,
        running(noise_study(display="fit")) as fitted_address,
        running(triplets) as triplet_address,
        running(boosted) as boosted_address,
        launch(executable_path=chromium_path(), args=[*FLAGS, *flags]) as browser,
        browser.new_context(no_viewport=True) as context,
    ):
        page = context.new_page()
        begin(page, address)
        assert page.evaluate("devicePixelRatio") == pytest.approx(ratio, abs=1e-6)
        for times in (1, 2):
            blocks = np.kron(noise, np.ones((times, times, 1), np.uint8))
            for view, sides in (("beside", 2), ("flicker", 1), ("wipe", 1)):
                page.click(f"[data-mode={view}]")
                expect(page.locator(".badge")).to_have_text(f"{times}:1")
                drawn = on_screen(page, ratio)
                assert len(drawn) == sides
                for one in drawn:
                    np.testing.assert_array_equal(one, middle(blocks, one.shape))
                if view == "flicker":
                    page.keyboard.down("f")
                    expect(page.locator("figcaption").first).to_have_text("B")
                    np.testing.assert_array_equal(on_screen(page, ratio)[0], drawn[0])
                    page.keyboard.up("f")
            page.click("[data-mode=beside]")
            page.keyboard.press("+")
        begin(page, fitted_address)
        drawn = on_screen(page, ratio)
        np.testing.assert_array_equal(*drawn)
        address = json.loads(page.locator("main").get_attribute("data-images"))[0]["address"]
        sent = page.request.get(f"{fitted_address[:-1]}{address}{drawn[0].shape[1]}")
        np.testing.assert_array_equal(drawn[0], picture(sent.body()))
        if ratio not in (1, 3):  # each costs seconds; where they stand is whole at any ratio
            return
        for address, times in ((triplet_address, 1), (boosted_address, 3)):
            begin(page, address)
            expect(page.locator(".badge")).to_have_text(f"{times}:1")
            blocks = np.kron(noise, np.ones((times, times, 1), np.uint8))
            drawn = on_screen(page, ratio)
            assert len(drawn) == 3
            for one in drawn:
                np.testing.assert_array_equal(one, middle(blocks, one.shape))


#: What every image of `noise_study` shows, 960 x 540.
NOISE = np.random.default_rng(0).integers(0, 256, (540, 960, 3)).astype(np.uint8)


@pytest.fixture(scope="module")
def noise_folder(tmp_path_factory, write_study):
    """Folders of studies in which every image is the same noise with a region, by their viewers."""
    root, out = tmp_path_factory.mktemp("noise"), io.BytesIO()
    Image.fromarray(NOISE).save(out, "PNG")
    digest = hashlib.sha256(out.getvalue()).hexdigest()

    def write(**viewer):
        name = hashlib.sha256(repr(viewer).encode()).hexdigest()[:8]
        if (root / name).exists():
            return root / name
        directory = write_study(root / name, size=(960, 540), viewer=viewer)
        manifest = json.loads((directory / "manifest.json").read_text())
        manifest["format"] = "subdermal-manifest/3"
        for one in manifest["images"]:
            (directory / one["file"]).write_bytes(out.getvalue())
            one |= {"sha256": digest, "region": [0.1, 0.2, 0.9, 0.8]}
        (directory / "manifest.json").write_text(json.dumps(manifest))
        return directory

    return write


@pytest.fixture
def noise_study(noise_folder, fresh):
    """Applications over these studies, each with a new database."""
    return lambda **viewer: create_app(noise_folder(**viewer), fresh())


def on_screen(page, ratio):
    """What a screenshot has where the canvases stand."""
    page.wait_for_selector(".pair:not(.loading)")
    screen, found = picture(page.screenshot()), []
    for canvas in page.locator(".pair canvas").all():
        if box := canvas.bounding_box():
            rows, columns = (
                slice(*edges(box, *names, ratio)) for names in (("y", "height"), ("x", "width"))
            )
            found.append(screen[rows, columns])
    return found


def middle(pixels, shape):
    """The middle part of an image, of that height and width."""
    top, left = ((pixels.shape[k] - shape[k] + 1) // 2 for k in (0, 1))
    assert top >= 0 and left >= 0
    return pixels[top : top + shape[0], left : left + shape[1]]


def test_no_frame_is_blank_while_images_are_swapped_and_it_is_recorded(page, address, app):
    begin(page, address)
    page.keyboard.press("v")
    expect(page.locator("[data-mode=flicker]")).to_have_attribute("aria-pressed", "true")
    page.wait_for_selector(".pair:not(.loading)")
    colours = page.evaluate(
        """async () => {
        const canvas = document.querySelector(".pair canvas"), seen = [];
        const reader = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
        for (let k = 0; k < 20; k += 1) {
          document.dispatchEvent(new KeyboardEvent(k % 2 ? "keyup" : "keydown", { key: "f" }));
          await new Promise(requestAnimationFrame);
          reader.drawImage(canvas, 0, 0, 1, 1);
          const { data } = reader.getImageData(0, 0, 1, 1);
          seen.push([...data].join());
        }
        return seen;
      }"""
    )
    assert len(set(colours[::2])) == len(set(colours[1::2])) == 1 and colours[0] != colours[1]
    page.evaluate("document.hasFocus = () => false; window.dispatchEvent(new Event('blur'))")
    page.wait_for_timeout(200)
    page.evaluate("delete document.hasFocus; window.dispatchEvent(new Event('focus'))")
    page.keyboard.press("1")
    page.keyboard.press("Enter")
    shown(page, 2)
    ((_, row),) = stored(app)
    assert (row.view, row.flips, row.wipe_ms) == ("flicker", 20, 0)
    assert row.away_ms >= 200 and row.beside_ms > 0 and row.flicker_ms > 0
    assert abs(row.beside_ms + row.flicker_ms + row.away_ms - row.rt_ms) <= 3
    assert 0 < row.pixel_scale < row.pixel_scale_largest and row.seen_share == 1


def test_both_images_zoom_and_move_together(noise_study, chromium):
    with (
        running(noise_study(surround=40)) as address,
        chromium.new_context(viewport={"width": 900, "height": 700}) as context,
    ):
        page = context.new_page()
        begin(page, address)
        assert picture(page.screenshot())[350, 2].tolist() == [40, 40, 40]
        canvas = page.locator(".pair canvas").first
        before = on_screen(page, 1)
        box = canvas.bounding_box()
        page.mouse.move(box["x"] + 50, box["y"] + 60)
        page.mouse.wheel(0, -100)  # keeps what is under the pointer
        expect(page.locator(".badge")).to_have_text("2:1")
        larger = on_screen(page, 1)
        np.testing.assert_array_equal(*larger)
        page.mouse.down()
        page.mouse.move(box["x"] + 20, box["y"] + 40)
        page.mouse.up()
        moved = on_screen(page, 1)
        np.testing.assert_array_equal(*moved)
        np.testing.assert_array_equal(moved[0][:-20, :-30], larger[0][20:, 30:])
        page.keyboard.press("Shift+ArrowRight")
        assert not np.array_equal(on_screen(page, 1)[0], moved[0])
        page.keyboard.press("0")
        expect(page.locator(".badge")).to_have_text("1:1")
        assert on_screen(page, 1)[0].shape == before[0].shape


def test_fingers_swap_zoom_and_move(noise_study, chromium):
    screen = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    with (
        running(noise_study()) as address,
        chromium.new_context(**screen) as context,
    ):
        page = context.new_page()
        touch = context.new_cdp_session(page)

        def fingers(kind, *places):
            points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(places)]
            touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        page.goto(address)
        page.check("[name=consent]")
        page.click("text=Begin")
        expect(page.locator(".coarse")).to_be_visible()
        expect(page.locator(".fine")).to_be_hidden()
        page.get_by_label("Some familiarity").check()
        page.click("text=Continue")
        shown(page, 1)
        box = page.locator(".pair canvas").first.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        fingers("touchStart", (x - 20, y), (x + 20, y))
        fingers("touchMove", (x - 28, y), (x + 28, y))
        fingers("touchEnd")
        expect(page.locator(".badge")).to_have_text("2:1")
        page.wait_for_timeout(300)  # what follows at once belongs to the same gesture
        before = on_screen(page, 1)[0]
        fingers("touchStart", (x, y))
        fingers("touchMove", (x - 30, y))
        fingers("touchEnd")
        page.wait_for_timeout(300)
        np.testing.assert_array_equal(on_screen(page, 1)[0][:, :-30], before[:, 30:])
        page.click("[data-mode=flicker]")
        expect(page.locator("[data-mode=flicker]")).to_have_attribute("aria-pressed", "true")
        label = page.locator("figcaption").first
        fingers("touchStart", (x, y))
        expect(label).to_have_text("B")
        fingers("touchEnd")
        expect(label).to_have_text("A")


def picture(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def edges(box, start, size, ratio):
    """First device pixel and one past the last; both are whole to within a browser's 1/64 px."""
    found = [box[start] * ratio, (box[start] + box[size]) * ratio]
    assert found == pytest.approx([round(edge) for edge in found], abs=0.1)
    return [round(edge) for edge in found]


def sign_in(page, address, app):
    """Open the dashboard with the account of the first start."""
    with app.extensions["database"].write() as db:
        secret = accounts.add_first(db)
    page.goto(f"{address}dashboard/")
    page.fill("[name=name]", accounts.FIRST)
    page.fill("[name=password]", secret)
    page.click("button:has-text('Sign in')")


def test_the_dashboard_refreshes_by_itself(page, address, app):
    sign_in(page, address, app)
    expect(page.locator(".figures dd").first).to_have_text("0")
    with page.context.browser.new_context() as other:
        begin(other.new_page(), address)
    expect(page.locator(".figures dd").first).to_have_text("1", timeout=10_000)


@pytest.mark.parametrize(("width", "longest"), [(390, 2200), (1280, 2900)])
def test_the_dashboard_folds_on_a_phone_and_axe_finds_nothing(
    page, address, app, person, width, longest
):
    from axe_playwright_python.sync_playwright import Axe

    for k in range(3):
        person().begin().answer(*[(i * (k + 2)) % 5 - 2 for i in range(30)])
    page.set_viewport_size({"width": width, "height": 720})
    sign_in(page, address, app)
    expect(page.locator("#fold-results .results").first).to_be_visible()
    size = page.evaluate("[document.body.scrollHeight, document.documentElement.scrollWidth]")
    assert size[0] < longest and size[1] == width  # tables scroll within the page
    balance = page.locator("#fold-balance")
    assert balance.evaluate("one => one.open") == (width > 500)
    page.click("#fold-balance summary")
    assert balance.evaluate("one => one.open") == (width < 500)
    person().begin()  # what changes is put in its place, and what was folded stays as it is
    expect(page.locator(".figures dd").first).to_have_text("4", timeout=10_000)
    assert balance.evaluate("one => one.open") == (width < 500)
    page.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
    violations = Axe().run(page, options=RULES).response["violations"]
    assert [(one["id"], one["nodes"][0]["html"]) for one in violations] == []


def test_the_pages_of_researchers_fit_a_phone_and_axe_finds_nothing(page, address, app, person):
    from axe_playwright_python.sync_playwright import Axe

    def look():
        assert page.evaluate("document.documentElement.scrollWidth") == 390, page.url
        violations = Axe().run(page, options=RULES).response["violations"]
        assert [(one["id"], one["nodes"][0]["html"]) for one in violations] == [], page.url

    person().begin()
    with app.extensions["database"].write() as db:
        accounts.add(db, "ada.lovelace@example.org", "viewer", "x" * 12, who="the test")
        notes.add(db, db.get(Participant, 1), "wore " + "sunglasses" * 20, who="owner")
        secret = "another password"
        accounts.add(db, "owner", "owner", secret, who="the test")
    page.set_viewport_size({"width": 390, "height": 720})
    page.goto(f"{address}dashboard/login")
    look()
    page.fill("[name=name]", "owner")
    page.fill("[name=password]", secret)
    page.click("button:has-text('Sign in')")
    for path in ("log", "notes", "studies", "password", "participants/P0001"):
        page.goto(f"{address}dashboard/{path}")
        look()
    page.fill("[name=note]", "<b>two</b>\nlines")
    page.click("button:has-text('Add')")
    expect(page.locator(".note .text").first).to_have_text("<b>two</b>\nlines")


def test_the_simulated_study_is_marked(page, study_dir, fresh):
    with running(create_app(study_dir, fresh(), simulated=True)) as address:
        page.goto(address)
        expect(page.locator(".simulated")).to_be_visible()
        assert page.title().startswith("SIMULATED")


#: What axe-core looks for: WCAG 2.0 to 2.2, A and AA.
RULES = {
    "runOnly": {
        "type": "tag",
        "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22a", "wcag22aa"],
    }
}


def test_axe_finds_nothing_on_the_pages_of_a_participant(tmp_path, write_study, page):
    """Each kind of page once, the question in each view, on a desktop and on a phone."""
    from axe_playwright_python.sync_playwright import Axe

    study = {
        "before": [{"name": "age", "kind": "choice", "text": "Age?", "options": ["18", "19"]}],
        "after": [{"name": "words", "kind": "text", "text": "Remarks?", "required": False}],
        "reason": {"share": 1, "ticks": ["skin"]},
        "screen": {"least_px": [1200, 600], "plates": 2},
        "pages": {"instructions": "Look.", "debrief": "Skin.", "break_every": 1},
    }
    seen = []

    def check():
        found = Axe().run(page, options=RULES).response
        seen.append(page.locator("h1").text_content())
        assert [(one["id"], one["nodes"][0]["html"]) for one in found["violations"]] == [], seen

    with running(create_app(write_study(tmp_path / "asking", **study))) as address:
        page.goto(address)
        check()
        page.check("[name=consent]")
        page.click("text=Begin")
        check()
        page.get_by_label("Some familiarity").check()
        page.click("text=Continue")
        check()
        page.get_by_label("19").check()
        page.click("text=Continue")
        check()
        page.select_option("[name=dark_steps]", "4")
        page.select_option("[name=bright_steps]", "3")
        page.click("text=Continue")
        check()
        page.click("button:text('Begin')")
        shown(page, 1)
        for view in ("beside", "flicker", "wipe"):
            page.click(f"[data-mode={view}]")
            check()
        page.click(".help summary")
        page.click(".reason summary")
        check()
        page.set_viewport_size({"width": 390, "height": 844})
        check()
        page.keyboard.press("1")
        page.click("button:text('Confirm')")
        page.wait_for_selector("text=Time for a rest")
        check()
        for path in ("withdraw", "resume/"):
            page.goto(f"{address}{path}")
            check()
    assert len(set(seen)) == 9


def test_a_phone_is_asked_in_chinese_and_the_language_can_be_changed(
    chromium, tmp_path, write_study
):
    """Texts, not pixels: a machine without Chinese fonts draws boxes."""
    from axe_playwright_python.sync_playwright import Axe

    words = {"question": {"text": "哪张更真实？", "left_label": "甲", "right_label": "乙"}}
    study = {
        "languages": ["en", "zh"],
        "question": {"text": "Which is more real?", "left_label": "A", "right_label": "B"},
        "text": {"zh": {"title": "哪一个？", **words}},
    }
    screen = {"viewport": {"width": 390, "height": 844}, "device_scale_factor": 3}
    with (
        running(create_app(write_study(tmp_path / "study", **study))) as address,
        chromium.new_context(**screen, locale="zh-CN", has_touch=True, is_mobile=True) as context,
    ):
        page = context.new_page()
        page.goto(address)
        expect(page.locator("html")).to_have_attribute("lang", "zh-Hans")
        expect(page.locator("h1")).to_have_text("哪一个？")
        page.check("[name=consent]")
        page.click("button:text('开始')")
        page.get_by_label("有些熟悉").check()
        page.click("button:text('继续')")
        page.wait_for_selector("main.shown fieldset:enabled")
        expect(page.locator("h1")).to_have_text(re.compile("问题 1"))
        expect(page.locator("figcaption").first).to_have_text("甲")
        assert page.locator("canvas").first.get_attribute("aria-label") == "图像 甲"
        context.set_offline(True)
        page.get_by_label("看不出差别").check()
        page.click("button:text('确认')")
        expect(page.locator(".status")).to_have_text("尚未保存，正在重试……")
        context.set_offline(False)
        expect(page.locator("h1")).to_have_text(re.compile("问题 2"))
        page.wait_for_selector("main.shown fieldset:enabled")
        page.click(".languages-of-question > summary")
        assert Axe().run(page, options=RULES).response["violations"] == []
        page.click("button:text('English')")
        shown(page, 2)
        expect(page.locator("html")).to_have_attribute("lang", "en")
        expect(page.locator("legend")).to_have_text("Which is more real?")


def test_boosted_images_take_turns_with_the_reference_unless_that_is_stopped(
    chromium, tmp_path, write_study
):
    """At the rate of the study, both at once; not where less motion is asked for."""
    from axe_playwright_python.sync_playwright import Axe

    boost = {"flicker_hz": 5, "amplify": 2}
    viewer = {"modes": ["boosted"], "reference": "golubev", "boost": boost}
    words = {1: "B", -5: "Clearly A", 5: "Clearly B"}
    scale = [
        {"value": v, "label": words.get(v, ""), "counts": (v > 0) - (v < 0)} for v in range(-5, 6)
    ]
    study_dir = write_study(tmp_path / "study", size=(320, 180), viewer=viewer, scale=scale)
    app = create_app(study_dir)
    look = """async (frames) => {
      const canvases = [...document.querySelectorAll(".pair canvas")], seen = [];
      const reader = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
      for (let k = 0; k < frames; k += 1) {
        await new Promise(requestAnimationFrame);
        seen.push(canvases.map((canvas) => {
          reader.drawImage(canvas, 0, 0, 1, 1);
          return [...reader.getImageData(0, 0, 1, 1).data].join();
        }));
      }
      return seen;
    }"""
    with (
        running(app) as address,
        chromium.new_context(
            viewport={"width": 1280, "height": 720}, reduced_motion="reduce"
        ) as context,
    ):
        page = context.new_page()
        begin(page, address)
        captions = page.locator("figcaption").all_text_contents()
        assert captions == ["A", "Reference", "B"]
        button = page.locator("[data-flicker]")
        expect(button).to_have_attribute("aria-pressed", "false")
        still = page.evaluate(look, 10)
        assert len(set(map(tuple, still))) == 1
        colours = [tuple(map(int, one.split(",")))[:3] for one in still[0]]
        study = app.extensions["study"]
        with app.extensions["database"].read() as db:
            trial = db.scalars(select(Trial).order_by(Trial.order)).first()
        a, reference, b = (
            np.asarray(Image.open(study.image(trial.cell, name).path))[0, 0].astype(int)
            for name in (trial.left, "golubev", trial.right)
        )
        for seen, raw in zip(colours, (a, reference, b)):
            assert seen == tuple(np.clip(reference + 2 * (raw - reference), 0, 255))
        button.click()
        expect(button).to_have_attribute("aria-pressed", "true")
        moving = {*map(tuple, page.evaluate(look, 40))}
        assert moving == {tuple(still[0]), (still[0][1],) * 3}  # both at once, nothing between
        page.keyboard.press("f")
        expect(button).to_have_attribute("aria-pressed", "false")
        assert len({*map(tuple, page.evaluate(look, 10))}) == 1
        assert Axe().run(page, options=RULES).response["violations"] == []
        page.set_viewport_size({"width": 390, "height": 844})
        boxes = [one.bounding_box() for one in page.locator(".pair canvas").all()]
        assert len({box["x"] for box in boxes}) == 1 and boxes[0]["y"] < boxes[1]["y"]
        expect(page.locator(".ends")).to_be_visible()
        assert page.get_by_role("radio", name="Clearly B").count() == 1
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert Axe().run(page, options=RULES).response["violations"] == []
        page.keyboard.press("4")
        page.keyboard.press("Enter")
        shown(page, 2)
    ((_, row),) = stored(app)
    assert row.view == "boosted" and row.pixel_scale == 2
    assert (row.point, row.answer) == (-2, -1)
    assert row.boosted_ms == pytest.approx(row.rt_ms - row.away_ms, abs=2)
    assert 2 <= row.flips <= 2 * 5 * row.rt_ms / 1000 + 2


@pytest.mark.parametrize("mode", ["triplet", "boosted"])
def test_triplets_on_a_large_screen_a_phone_and_at_twice_the_zoom(
    chromium, tmp_path, write_study, mode
):
    """Both images and their reference are wholly on the screen and equally large, the header takes
    two rows at most in every language, and an answer can be given.
    """
    from axe_playwright_python.sync_playwright import Axe

    viewer = {"modes": [mode], "reference": "golubev"}
    words = tomllib.loads(THESIS.read_text("utf-8"))
    texts = {key: words[key] for key in ("languages", "text", "question", "scale", "familiarity")}
    study_dir = write_study(tmp_path / mode, size=(320, 180), viewer=viewer, **texts)
    app = create_app(study_dir)
    screens = [(1920, 1080, 1), (390, 844, 3), (640, 360, 2)]
    with running(app) as address:
        for width, height, ratio in screens:
            screen = {"viewport": {"width": width, "height": height}, "device_scale_factor": ratio}
            touch = {"is_mobile": True, "has_touch": True} if width < 500 else {}
            with chromium.new_context(**screen, **touch, locale="en-GB") as context:
                page = context.new_page()
                begin(page, address)
                boxes = [one.bounding_box() for one in page.locator(".pair canvas").all()]
                assert len(boxes) == 3
                assert len({(box["width"], box["height"]) for box in boxes}) == 1
                for box in boxes:
                    assert box["x"] >= 0 and box["x"] + box["width"] <= width
                    assert box["y"] >= 0 and box["y"] + box["height"] <= height
                violations = Axe().run(page, options=RULES).response["violations"]
                assert [(one["id"], one["nodes"][0]["html"]) for one in violations] == []
                for name in texts["languages"] if touch else []:
                    page.click(".languages-of-question > summary")
                    page.click(f".languages-of-question button[value={name}]")
                    page.wait_for_selector("main.shown fieldset:enabled")
                    header = page.locator(".question header").bounding_box()["height"]
                    assert header < 80  # it took three rows and 122 px
                    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
                page.locator("input[name=answer]").first.check()
                page.locator(".confirm button").click()
                page.wait_for_selector("main[data-trial].shown fieldset:enabled")
                expect(page.locator("input[name=answer]:checked")).to_have_count(0)
    rows = [row for _, row in stored(app)]
    assert [row.view for row in rows] == [mode] * 3
    assert [row.device_pixel_ratio for row in rows] == [ratio for *_, ratio in screens]


def test_answers_stand_below_the_middle_of_the_pair_and_a_reason_takes_a_line_of_its_own(
    chromium, tmp_path, write_study
):
    """No side's answers are nearer to their image; opened at 200 %, the reason took the answers'
    place.
    """
    reason = {"share": 1.0, "text": "Why?", "ticks": ["shadows"], "free": True}
    app = create_app(write_study(tmp_path / "study", size=(320, 180), reason=reason))
    with running(app) as address:
        for width, height, ratio in [(1920, 1080, 1), (1280, 720, 1), (640, 360, 2)]:
            screen = {"viewport": {"width": width, "height": height}, "device_scale_factor": ratio}
            with chromium.new_context(**screen, locale="en-GB") as context:
                page = context.new_page()
                begin(page, address)
                page.click(".reason > summary")
                box = page.locator("fieldset.scale").bounding_box()
                if width > 1000:
                    assert box["x"] + box["width"] / 2 == pytest.approx(width / 2, abs=1)
                assert box["width"] > 0.59 * width
                assert page.locator(".reason").bounding_box()["y"] > box["y"] + box["height"] - 1
                confirm = page.locator(".confirm button").bounding_box()
                assert confirm["x"] >= box["x"] + box["width"]
                assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
                page.click("details.help >> nth=0 >> summary")
                assert "Enter" in page.inner_text("details.help >> nth=0")
                assert "Tap" not in page.inner_text("details.help >> nth=0")


def test_inspect_shows_a_study_without_a_server(study_dir, page):
    from app.cli import main

    assert main(["inspect", str(study_dir)]) == 0
    page.goto((study_dir / "inspection" / "index.html").as_uri())
    page.wait_for_selector(".question.shown")
    boxes = [canvas.bounding_box() for canvas in page.locator(".pair canvas").all()]
    assert len(boxes) == 2 and min(box["width"] for box in boxes) > 200
    first = page.locator("img[data-map]").get_attribute("src")
    page.select_option("select[data-b]", "golubev_plus")
    page.wait_for_function(
        "src => document.querySelector('[data-map]').getAttribute('src') !== src", arg=first
    )
    page.keyboard.press("v")
    assert page.locator("[data-mode=flicker]").get_attribute("aria-pressed") == "true"
    assert page.evaluate("document.querySelector('[data-map]').naturalWidth") == 960
    page.locator("button[data-show]").last.click()
    assert page.locator("select[data-cell]").input_value() == "half-length"
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    colours = "getComputedStyle(document.querySelector('select[data-cell]'))"
    assert page.evaluate(f"{colours}.color") != page.evaluate(f"{colours}.backgroundColor")
    tallest = "Math.max(...[...document.querySelectorAll('.found tr')].map(r => r.offsetHeight))"
    assert page.evaluate(tallest) < 60  # names that broke after each letter took 400
