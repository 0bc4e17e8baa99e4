// Formulas are code blocks of the language `math`, which GitHub renders. In the book MathJax renders them.
for (const code of document.querySelectorAll("code.language-math")) {
    const formula = document.createElement("div");
    formula.textContent = "\\[" + code.textContent + "\\]";
    code.parentElement.replaceWith(formula);
}
