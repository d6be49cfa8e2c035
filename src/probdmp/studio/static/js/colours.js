// Colours come from the style sheet, so that light and dark are decided in one place.

const scheme = matchMedia("(prefers-color-scheme: dark)");
let known = {};

/** The value of a custom property such as "--accent". */
export function colour(name) {
  known[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return known[name];
}

/** Calls back when the scheme changes. */
export function onScheme(listener) {
  scheme.addEventListener("change", () => {
    known = {};
    listener();
  });
}
