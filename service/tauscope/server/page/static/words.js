// The page's words in the reader's language: English stands where it is said, German beside it in german.js.

import { EFFECTS } from "./effects.js";
import { NAMES, SENTENCES } from "./german.js";

const STORE = "tauscope-language";
export const LANGUAGES = { en: "English", de: "Deutsch" };

/** What the reader has chosen, else the first of the browser's languages that the page speaks. */
export const language = [localStorage.getItem(STORE), ...navigator.languages].map((each) => each?.slice(0, 2)).find((each) => each in LANGUAGES) ?? "en";

const isGerman = language === "de";

/** Speak another language: the page is loaded anew, which no motion and no lease minds. */
export function speak(other) {
  localStorage.setItem(STORE, other);
  location.reload();
}

/** A sentence of the page, as a template: t`From ${low} to ${high}`; German may put its parts in another order. */
export function t(strings, ...values) {
  const sentence = strings.reduce((before, part, place) => `${before}{${place - 1}}${part}`);
  return ((isGerman && SENTENCES[sentence]) || sentence).replace(/\{(\d+)\}/g, (_, place) => values[place]);
}

/** An id of the service, such as load_dependent_friction, as words. */
export function named(id) {
  const german = isGerman && [NAMES, EFFECTS].find((names) => Object.hasOwn(names, id));
  return german ? german[id] : id.replaceAll("_", " ");
}
