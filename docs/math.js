// Formulas are code blocks of the language `math`, which GitHub renders. In the book this script turns them into MathML, which browsers draw
// without any other file. It knows the commands of these pages; an unknown one is an error, which a test finds.
"use strict";
{
  const SPACES = { ",": 0.17, "!": -0.17, " ": 0.3, quad: 1, qquad: 2 };
  const SYMBOLS = {
    partial: "∂", sum: "∑", le: "≤", ge: "≥", approx: "≈", cdot: "·", dots: "…", leftarrow: "←", rightarrow: "→", infty: "∞", pm: "±",
    times: "×", in: "∈", int: "∫", "{": "{", "}": "}",
  };
  const WORDS = ["max", "min", "sin", "cos", "tan", "exp", "ln"];
  const ACCENTS = { dot: "˙", ddot: "¨", hat: "^", tilde: "~", bar: "¯" };

  // `text` as a tree of MathML.
  function formula(text) {
    const tokens = text.match(/\\[A-Za-z]+|\\.|[0-9]+(?:\.[0-9]+)?|\S/gu) || [];
    let at = 0;
    const node = (name, content, attributes = {}) => {
      const made = document.createElementNS("http://www.w3.org/1998/Math/MathML", name);
      made.append(...[content].flat());
      Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
      return made;
    };
    const row = (items) => (items.length === 1 ? items[0] : node("mrow", items));
    const fence = (text, stretchy = true) => node("mo", text, { stretchy, fence: true });
    // The text of a group, as for \text{…}: its tokens lose spaces, so it is cut out of the source.
    let rest = text;
    const verbatim = (command) => {
      const from = rest.indexOf(command + "{") + command.length + 1;
      const to = rest.indexOf("}", from);
      const found = rest.slice(from, to);
      rest = rest.slice(to + 1);
      while (tokens[at] !== "}") at += 1;
      at += 1;
      return found;
    };
    // Items up to one of the given tokens, which is consumed.
    function until(...ends) {
      const items = [];
      while (at < tokens.length && !ends.includes(tokens[at])) items.push(scripted());
      at += 1;
      return items;
    }
    // An item with its index and exponent.
    function scripted() {
      let base = item();
      let [lower, upper] = [null, null];
      while (tokens[at] === "_" || tokens[at] === "^") {
        const isLower = tokens[at++] === "_";
        if (isLower) lower = argument(); else upper = argument();
      }
      const isLimit = base.dataset && base.dataset.limits;
      if (lower && upper) base = node(isLimit ? "munderover" : "msubsup", [base, lower, upper]);
      else if (lower) base = node(isLimit ? "munder" : "msub", [base, lower]);
      else if (upper) base = node(isLimit ? "mover" : "msup", [base, upper]);
      return base;
    }
    function bracket() {
      const token = tokens[at++];
      return fence(token === "." ? "" : token.replace("\\", ""));
    }
    // An argument without braces is one digit, not a number.
    function argument() {
      const token = tokens[at];
      if (/^[0-9]{2}/.test(token)) tokens.splice(at, 1, token[0], token.slice(1));
      return item();
    }
    function item() {
      const token = tokens[at++];
      if (token === undefined) throw new Error(`a formula ends too early: ${text}`);
      if (token === "{") return row(until("}"));
      if (/^[0-9]/.test(token)) return node("mn", token);
      if (!token.startsWith("\\")) {
        if (/\p{L}/u.test(token)) return node("mi", token);
        const isFence = "()[]|".includes(token);
        return isFence ? fence(token, false) : node("mo", token === "-" ? "−" : token === "*" ? "∗" : token);
      }
      const name = token.slice(1);
      if (name in SPACES) return node("mspace", [], { width: `${SPACES[name]}em` });
      if (WORDS.includes(name)) {
        const made = node("mo", name, { lspace: "0.17em", rspace: "0.17em" });
        if (name === "max" || name === "min") made.dataset.limits = "1";
        return made;
      }
      if (name in SYMBOLS) {
        const made = node(name === "partial" || name === "infty" ? "mi" : "mo", SYMBOLS[name], name === "{" || name === "}" ? { stretchy: false } : {});
        if (name === "sum") made.dataset.limits = "1";
        return made;
      }
      if (name in ACCENTS) return node("mover", [argument(), node("mo", ACCENTS[name], { stretchy: false })], { accent: true });
      if (name === "frac") return node("mfrac", [argument(), argument()]);
      if (name === "tfrac") return node("mstyle", node("mfrac", [argument(), argument()]), { displaystyle: false, scriptlevel: 1 });
      if (name === "text") return node("mtext", verbatim("\\text").replaceAll(" ", "\u00a0"));
      if (name === "mathrel") return node("mo", [item()].map((made) => made.textContent), { lspace: "0.28em", rspace: "0.28em" });
      if (name === "Big") return node("mo", tokens[at++], { stretchy: true, minsize: "1.8em", symmetric: true });
      if (name === "left") {
        const open = bracket();
        const inner = until("\\right");
        return node("mrow", [open, ...inner, bracket()]);
      }
      if (name === "begin") {
        verbatim("\\begin");
        const rows = [[]];
        for (;;) {
          const cell = [];
          while (at < tokens.length && !["&", "\\\\", "\\end"].includes(tokens[at])) cell.push(scripted());
          rows[rows.length - 1].push(node("mtd", cell));
          const end = tokens[at++];
          if (end === "\\\\") rows.push([]);
          if (end === "\\end") break;
        }
        verbatim("\\end");
        return node("mrow", [fence("["), node("mtable", rows.map((cells) => node("mtr", cells))), fence("]")]);
      }
      throw new Error(`unknown command \\${name} in a formula`);
    }
    return node("math", row(until()), { display: "block" });
  }

  for (const code of document.querySelectorAll("code.language-math")) {
    const shown = document.createElement("div");
    shown.className = "formula";
    shown.style.cssText = "overflow-x: auto; margin: 1em 0";
    shown.append(formula(code.textContent));
    code.parentElement.replaceWith(shown);
  }
}
