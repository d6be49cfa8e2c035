"""Strokes of a pointer become what was learned, on the canvas and in the charts."""

from studio_browser import Studio, line


def test_a_letter_drawn_three_times_has_a_band(studio: Studio) -> None:
    studio.says("#hint", "Draw an a, in one stroke, three times.")
    studio.teach(strokes=2)
    studio.draw(shift=1)
    studio.says(".count", "3 strokes, learned")
    studio.says("#hint", "It knows the movement. Press Play.")
    described = "3 strokes of a; the mean path with its band of two standard deviations"
    studio.becomes("document.getElementById('paper').getAttribute('aria-label')", described)
    studio.counts("#strokes svg polyline", 3)
    studio.says("#change", "the third demonstration")


def test_the_canvas_stays_where_it_is_whatever_the_hint(studio: Studio) -> None:
    place, hint = "document.getElementById('board').getBoundingClientRect().y", "document.getElementById('hint').textContent"
    studio.says("#hint", "in one stroke")
    before = studio.page.evaluate(f"{hint} = 'Short.'; {place}")
    assert studio.page.evaluate(f"{hint} = 'A sentence of two lines, '.repeat(4); {place}") == before


def test_hints_count_the_strokes(studio: Studio) -> None:
    studio.draw()
    studio.says("#hint", "Again, twice more")
    studio.draw(shift=1)
    studio.lists("#hint", "Once more.")


def test_every_quantity_has_charts_of_both_degrees_of_freedom(studio: Studio) -> None:
    studio.use_example()
    for tab in ("Position", "Velocity", "Acceleration", "Forcing"):
        studio.page.get_by_role("tab", name=tab).click()
        studio.says("#charts figcaption", tab)
        studio.counts("#charts .uplot", 2)


def test_a_stroke_is_deleted_and_taken_back(studio: Studio) -> None:
    studio.teach()
    studio.page.get_by_role("button", name="Delete stroke 2 of a").click()
    studio.counts("#strokes li", 2)
    studio.page.get_by_role("button", name="Undo").click()
    studio.counts("#strokes li", 3)


def test_a_tap_is_no_stroke(studio: Studio) -> None:
    studio.page.click("#ink")
    studio.teach(strokes=1)  # and no other one is there, nor was one refused
    assert studio.page.is_hidden("#toast")


def test_letters_are_added_renamed_and_deleted(studio: Studio) -> None:
    page = studio.page
    studio.teach("one", 1)
    studio.teach("two", 1, line)
    studio.lists("#labels .name", "one", "two")
    page.get_by_role("button", name="Rename two").click()
    page.get_by_label("New name of two").fill("deux")
    page.keyboard.press("Enter")
    studio.lists("#labels .name", "one", "deux")
    page.get_by_role("button", name="Delete deux and its strokes").click()
    studio.lists("#labels .name", "one")


def test_a_name_is_text_whatever_it_contains(studio: Studio) -> None:
    hostile = "<img src=x onerror=alert(1)>"
    studio.teach(hostile, 2)
    page = studio.page
    studio.lists("#labels .name", hostile)
    studio.lists("#strokes-title", f"Strokes of {hostile}")
    page.click("#teach-play")
    studio.shows("#verdict:not([data-kind=none])")
    assert page.locator("main img").count() == 0


def test_the_model_is_chosen_in_a_dialog(studio: Studio) -> None:
    page = studio.page
    studio.teach(strokes=1)
    page.click("#open-model")
    studio.until("document.querySelectorAll('#weight_model option').length > 1")
    page.focus("#n_basis")
    studio.lists("#n-basis-text", "30")
    page.keyboard.press("ArrowLeft")
    studio.lists("#n-basis-text", "29")
    page.keyboard.press("Escape")
    page.click("#open-commands")
    studio.says("#commands-shell", "--n-basis 29")
