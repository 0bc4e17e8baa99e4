// What goes wrong in any script of the page can be read from its root.
window.addEventListener("error", (event) => {
  document.documentElement.dataset.state = `error: ${event.message}`;
});
