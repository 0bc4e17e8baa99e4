// What a page says when its server does not answer any more.

import { button, make } from "./elements.js";

// Number of requests without an answer, about one in a second, after which the server counts as ended.
const ENDED = 3;

// Returns a function to call after each answer, with 0, and after each request without one, with their number so far, and the name of the
// model file. It tells how to go on, and what becomes of the text in the editor.
export function connection(place, editor) {
  let told = "";
  return (failures, file) => {
    const is_ended = failures >= ENDED;
    const state = is_ended ? `${file} ${editor.unsent} ${editor.save.disabled}` : "";
    if (state === told) return;
    told = state;
    place.hidden = !is_ended;
    if (!is_ended) return place.replaceChildren();
    const copy = button("Copy the text", async () => { copy.textContent = (await editor.copy()) ? "Copied" : "Copy the selected text by hand"; });
    const text = editor.unsent ? ["The text below Model file was not sent and is only in this page. Before you close it: ", copy]
      : [editor.save.disabled ? "All text is saved." : `Text that is not saved is kept in ${file}.unsaved; the new page shows it.`];
    place.replaceChildren("The server of this page does not answer: it has ended, or was started again at another address. To go on, run ",
      make("code", { text: `linkwright open ${file}` }), " in the folder of the file, and open the address that it prints. ", ...text);
  };
}
