// Runs before the first paint, so that a chosen theme does not flash. A classic script on purpose.
{
  const chosen = new URLSearchParams(location.search).get("theme") || localStorage.getItem("retake.theme");
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  document.documentElement.dataset.theme = chosen === "light" || chosen === "dark" ? chosen : dark ? "dark" : "light";
}
