// Search over search-index.js, from the file system too: names first, then summaries, parameters, help.
(function () {
  "use strict";
  const input = document.getElementById("search"), list = document.getElementById("found");
  const root = input.dataset.root;
  let chosen = -1;

  // How well an entry fits a word; 0 not at all.
  function fit(entry, word) {
    const title = entry.t.toLowerCase().replace(/^pattern /, "");
    if (title === word) return 100;
    if (title.startsWith(word)) return 50;
    if (title.includes(word)) return 30;
    if (entry.s.toLowerCase().includes(word)) return 12;
    if ((" " + entry.p.toLowerCase()).includes(" " + word)) return 8;
    if (entry.k.toLowerCase().includes(word)) return 5;
    return entry.h.toLowerCase().includes(word) ? 2 : 0;
  }

  function search(text) {
    const words = text.toLowerCase().replace(/--/g, "").split(/\s+/).filter(Boolean);
    if (words.length === 0) return [];
    const hits = [];
    for (const entry of window.bookIndex) {
      const fits = words.map((word) => fit(entry, word));
      if (fits.every((f) => f > 0)) hits.push([fits.reduce((a, b) => a + b), entry]);
    }
    hits.sort((a, b) => b[0] - a[0] || a[1].t.length - b[1].t.length);
    return hits.slice(0, 12).map((h) => h[1]);
  }

  function show() {
    list.textContent = "";
    chosen = -1;
    const hits = search(input.value);
    for (const entry of hits) {
      const item = document.createElement("li"), link = document.createElement("a");
      const name = document.createElement("strong"), rest = document.createElement("span");
      link.href = root + entry.u;
      name.textContent = entry.t;
      rest.textContent = entry.s || entry.k;
      link.append(name, rest);
      item.append(link);
      list.append(item);
    }
    if (hits.length === 0 && input.value.trim()) {
      const item = document.createElement("li");
      item.textContent = "nothing found";
      list.append(item);
    }
    list.hidden = !input.value.trim();
  }

  input.addEventListener("input", show);
  input.addEventListener("focus", show);
  input.addEventListener("keydown", function (event) {
    const links = list.querySelectorAll("a");
    if (event.key === "Escape") {
      input.value = "";
      show();
    } else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      event.preventDefault();
      if (links.length === 0) return;
      chosen = (chosen + (event.key === "ArrowDown" ? 1 : links.length)) % links.length;
      links.forEach((link, i) => link.classList.toggle("chosen", i === chosen));
    } else if (event.key === "Enter" && links.length > 0) {
      location.href = links[Math.max(chosen, 0)].href;
    }
  });
  document.addEventListener("click", function (event) {
    if (!list.contains(event.target) && event.target !== input) list.hidden = true;
  });
  document.addEventListener("keydown", function (event) {
    if (event.key === "/" && document.activeElement !== input) {
      event.preventDefault();
      input.focus();
    }
  });
  if (location.hash.startsWith("#search=")) {
    input.value = decodeURIComponent(location.hash.slice(8));
    input.focus();
    show();
  }
})();
