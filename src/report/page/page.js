// The root element holds the first error of a script.
window.addEventListener("error", (event) => {
  document.documentElement.dataset.state = `error: ${event.message}`;
});
