"""Strokes of a pointer become what was learned, on the canvas and in the charts."""

from studio_browser import Studio, line


def test_a_letter_drawn_three_times_has_a_band(studio: Studio) -> None:
    page = studio.page
    assert page.inner_text("#hint") == "Draw an a, three times."
    studio.teach(strokes=2)
    studio.draw(shift=1)
    page.wait_for_selector('.count:text-is("3 strokes, learned")')
    assert page.inner_text("#hint") == "It knows the movement. Press Play."
    assert (
        page.get_attribute("#paper", "aria-label") == "3 strokes of a; the mean path with its band of two standard deviations"
    )
    assert page.locator("#strokes svg polyline").count() == 3
    studio.until("document.getElementById('change').textContent.startsWith('the third demonstration')")


def test_hints_count_the_strokes(studio: Studio) -> None:
    studio.draw()
    studio.until("document.getElementById('hint').textContent.startsWith('Again, twice more')")
    studio.draw(shift=1)
    studio.until("document.getElementById('hint').textContent === 'Once more.'")


def test_every_quantity_has_charts_of_both_degrees_of_freedom(studio: Studio) -> None:
    studio.use_example()
    for tab in ("Position", "Velocity", "Acceleration", "Forcing"):
        studio.page.get_by_role("tab", name=tab).click()
        assert studio.page.locator("#charts .uplot").count() == 2
        assert tab in studio.page.locator("#charts figcaption").first.inner_text()


def test_a_stroke_is_deleted_and_taken_back(studio: Studio) -> None:
    studio.teach()
    studio.page.get_by_role("button", name="Delete stroke 2 of a").click()
    studio.until("document.querySelectorAll('#strokes li').length === 2")
    studio.page.get_by_role("button", name="Undo").click()
    studio.until("document.querySelectorAll('#strokes li').length === 3")


def test_a_tap_is_no_stroke(studio: Studio) -> None:
    studio.page.click("#ink")
    studio.page.wait_for_timeout(200)
    assert studio.page.locator("#strokes li").count() == 0
    assert studio.page.is_hidden("#toast")


def test_letters_are_added_renamed_and_deleted(studio: Studio) -> None:
    page = studio.page
    studio.teach("one", 2)
    studio.teach("two", 2, line)
    assert page.locator("#labels .name").all_inner_texts() == ["one", "two"]
    page.get_by_role("button", name="Rename two").click()
    page.get_by_label("New name of two").fill("deux")
    page.keyboard.press("Enter")
    page.wait_for_selector('.name:text-is("deux")')
    page.get_by_role("button", name="Delete deux and its strokes").click()
    studio.until("document.querySelectorAll('#labels .name').length === 1")


def test_a_name_is_text_whatever_it_contains(studio: Studio) -> None:
    hostile = "<img src=x onerror=alert(1)>"
    studio.teach(hostile, 2)
    page = studio.page
    assert page.locator("#labels .name").inner_text() == hostile
    assert hostile in page.inner_text("#strokes-title")
    page.click("#teach-play")
    page.wait_for_selector("#verdict[data-kind=watching]")
    assert page.locator("main img").count() == 0


def test_the_model_is_chosen_in_a_dialog(studio: Studio) -> None:
    page = studio.page
    studio.teach(strokes=2)
    page.click("#open-model")
    assert page.locator("#weight_model option").count() > 1
    page.focus("#n_basis")
    before = page.inner_text("#n-basis-text")
    page.keyboard.press("ArrowLeft")
    assert page.inner_text("#n-basis-text") == str(int(before) - 1)
    page.keyboard.press("Escape")
    page.click("#open-commands")
    studio.until(f"document.getElementById('commands-shell').textContent.includes('--n-basis {int(before) - 1}')")
