// What was answered: kept in this browser, downloaded, or posted.

import { text } from "./texts.js";

/** Columns, as the report reads them. */
export const HEADER = [
  "study",
  "version",
  "person",
  "time",
  "trial",
  "part",
  "method",
  "item",
  "a",
  "b",
  "x",
  "answer",
  "rating",
  "role",
  "seconds",
  "headphones",
];

export class Answers {
  /** Of a study and a person; a study that was changed is another version, and begins anew. */
  constructor({ study, version, post }, person) {
    this.place = `promenade-study/${study}/${version}/${person ?? ""}`;
    Object.assign(this, { study, version, url: post, sending: Promise.resolve() });
    this.kept = this.read() ?? { person: null, rows: [], sent: 0, done: 0, headphones: "", consent: false };
  }

  read() {
    try {
      return JSON.parse(localStorage.getItem(this.place));
    } catch {
      return null;
    }
  }

  /** Keeps what there is. A browser that keeps nothing loses the answers with the page, no more. */
  save() {
    try {
      localStorage.setItem(this.place, JSON.stringify(this.kept));
    } catch {
      this.lost = true;
    }
  }

  forget() {
    try {
      localStorage.removeItem(this.place);
    } catch {
      // It kept nothing.
    }
  }

  /** Adds the rows of a trial; what they leave out is empty. */
  add(trial, rows) {
    const { person, headphones } = this.kept;
    for (const row of rows) {
      const { study, version } = this;
      const whole = { study, version, person, time: new Date().toISOString(), trial, headphones, ...row };
      this.kept.rows.push(HEADER.map((column) => String(whole[column] ?? "")));
    }
    this.kept.done = trial;
    this.save();
    // What cannot be sent now is sent with the next, or at the end.
    this.post().catch((error) => console.warn(`answers are kept: ${error.message}`));
  }

  get csv() {
    const cell = (words) => (/[",\r\n]/.test(words) ? `"${words.replaceAll('"', '""')}"` : words);
    return [HEADER, ...this.kept.rows].map((row) => row.map(cell).join(",")).join("\n") + "\n";
  }

  /** Sends what has not been sent, one post after the other; answers that come twice count once. Throws in words. */
  post() {
    this.sending = this.sending.catch(() => {}).then(() => this.send());
    return this.sending;
  }

  async send() {
    const { rows, sent } = this.kept;
    const all = rows.length;
    if (!this.url || sent === all) return;
    let answer;
    try {
      answer = await fetch(this.url, {
        method: "POST",
        headers: { "content-type": "application/json" },
        body: JSON.stringify({ rows: rows.slice(sent) }),
      });
    } catch {
      throw new Error(text("no server"));
    }
    if (!answer.ok) throw new Error(`${text("server answers", answer)}: ${(await answer.text()).slice(0, 200)}`);
    this.kept.sent = all;
    this.save();
  }

  download() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([this.csv], { type: "text/csv" }));
    link.download = `${this.study}-${this.kept.person}.csv`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }
}
