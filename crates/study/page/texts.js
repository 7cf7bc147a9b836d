// What the page says in the study's language. The texts come with the study; before it is here, none is said.

let texts = {};

/** Takes the texts of a study, by name. */
export const take = (given) => (texts = given);

/** A text with its values in place. */
export const text = (name, values = {}) => texts[name].replace(/\{(\w+)\}/g, (_, key) => values[key]);
