// Requests to the server. The address of the page ends with the token; all requests are relative to it.

const page = [...crypto.getRandomValues(new Uint8Array(12))].map((byte) => byte.toString(16).padStart(2, "0")).join("");

export class Outdated extends Error {}

async function request(route, body) {
  const options = body === undefined ? {} : { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
  // The message of the browser says less, and differs between browsers.
  const answer = await fetch(route, options).catch(() => { throw new Error("the server does not answer"); });
  if (answer.status === 409) throw new Outdated("a newer request has taken its place");
  if (!answer.ok) throw new Error(answer.status === 429 ? "too many pages wait for an analysis" : `the server answers with ${answer.status}`);
  return answer.json();
}

export const model = () => request("model");
export const cancel = () => request("cancel", { page });
export const analyze = (revision, design, derivatives) => request("analyze", { page, revision, design, derivatives });
// An analysis that does not replace those of the sliders.
export const analyzeBeside = (revision, design) => request("analyze", { page: `${page}+`, revision, design, derivatives: false });
export const post = (route, body) => request(route, body);
export const get = (route) => request(route);

// Calls `changed` after each change on the server. Without an answer, such as after a sleep of the computer, it asks again, and calls `lost`
// with the error and the number of requests that failed one after the other.
export async function follow(number, changed, lost) {
  let failures = 0;
  for (;;) {
    try {
      const news = (await request(`news?after=${number}`)).number;
      if (failures || news !== number) await changed();
      number = news;
      failures = 0;
    } catch (error) {
      failures += 1;
      lost(error, failures);
      await new Promise((resolve) => setTimeout(resolve, 1000));
    }
  }
}
