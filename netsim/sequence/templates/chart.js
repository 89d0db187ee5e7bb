"use strict";
(() => {
  const svg = document.getElementById("chart");
  const tip = document.getElementById("tip");
  const [body, axis, names, corner] = ["body", "axis", "names", "corner"].map((id) => document.getElementById(id));
  const width = +svg.dataset.width, height = +svg.dataset.height, head = +svg.dataset.head;
  const view = { scale: 1, x: 0, y: 0 };

  // Where things are: names stay above, the time axis stays at the left.
  function clamp(value, low, high) { return Math.min(Math.max(value, low), high); }
  function show() {
    const box = svg.getBoundingClientRect();
    const slack = 60;
    view.x = clamp(view.x, Math.min(0, box.width - width * view.scale - slack), Math.max(0, (box.width - width * view.scale) / 2));
    view.y = clamp(view.y, Math.min(0, box.height - height * view.scale - slack), 0);
    body.setAttribute("transform", `translate(${view.x} ${view.y}) scale(${view.scale})`);
    axis.setAttribute("transform", `translate(${Math.max(view.x, 0)} ${view.y}) scale(${view.scale})`);
    corner.setAttribute("transform", `translate(${Math.max(view.x, 0)} 0) scale(${view.scale})`);
    names.setAttribute("transform", `translate(${view.x} 0) scale(${view.scale})`);
  }
  function zoom(factor, x, y) {
    const scale = clamp(view.scale * factor, 0.15, 8);
    view.x = x - (x - view.x) * scale / view.scale;
    view.y = y - (y - view.y) * scale / view.scale;
    view.scale = scale;
    show();
  }
  function fit() {
    view.scale = clamp(svg.getBoundingClientRect().width / width, 0.55, 1.3);
    view.x = view.y = 0;
    show();
  }
  function zoomMiddle(factor) {
    const box = svg.getBoundingClientRect();
    zoom(factor, box.width / 2, box.height / 3);
  }
  function move(dx, dy) { view.x += dx; view.y += dy; show(); }

  svg.addEventListener("wheel", (event) => {
    event.preventDefault();
    const step = event.deltaMode === 1 ? 18 : 1;
    const box = svg.getBoundingClientRect();
    if (event.ctrlKey || event.metaKey) {
      zoom(Math.exp(-event.deltaY * step / 400), event.clientX - box.left, event.clientY - box.top);
    } else if (event.shiftKey && !event.deltaX) {
      move(-event.deltaY * step, 0);
    } else {
      move(-event.deltaX * step, -event.deltaY * step);
    }
  }, { passive: false });

  let drag = null;
  svg.addEventListener("pointerdown", (event) => { drag = { x: event.clientX, y: event.clientY, far: false }; });
  window.addEventListener("pointermove", (event) => {
    if (!drag) return;
    const dx = event.clientX - drag.x, dy = event.clientY - drag.y;
    if (!drag.far && Math.hypot(dx, dy) < 4) return;
    drag = { x: event.clientX, y: event.clientY, far: true };
    svg.classList.add("dragged");
    move(dx, dy);
  });
  window.addEventListener("pointerup", () => {
    svg.classList.remove("dragged");
    setTimeout(() => { drag = null; }); // after the click that ends a drag
  });

  document.getElementById("in").addEventListener("click", () => zoomMiddle(1.25));
  document.getElementById("out").addEventListener("click", () => zoomMiddle(0.8));
  document.getElementById("fit").addEventListener("click", fit);
  const page = () => svg.getBoundingClientRect().height * 0.85;
  const keys = {
    "+": () => zoomMiddle(1.25), "=": () => zoomMiddle(1.25), "-": () => zoomMiddle(0.8), "0": fit,
    ArrowUp: () => move(0, 60), ArrowDown: () => move(0, -60), ArrowLeft: () => move(60, 0), ArrowRight: () => move(-60, 0),
    PageUp: () => move(0, page()), PageDown: () => move(0, -page()),
    Home: () => move(0, height * view.scale), End: () => move(0, -height * view.scale),
    Escape: () => { held = null; dark(); },
  };
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
  window.addEventListener("resize", show);

  // Causal chains: back over the causes of causes, forward over the effects of effects.
  const causes = new Map(Object.entries(JSON.parse(document.getElementById("cause-data").textContent)));
  const effects = new Map();
  for (const [message, before] of causes) {
    for (const cause of before) {
      if (!effects.has(String(cause))) effects.set(String(cause), []);
      effects.get(String(cause)).push(message);
    }
  }
  function reached(from, steps) {
    const found = new Set([from]);
    for (const message of found) for (const next of steps.get(message) || []) found.add(String(next));
    return found;
  }
  const drawn = new Map(); // what is drawn of each message
  for (const element of svg.querySelectorAll("[data-m]")) {
    const message = element.dataset.m;
    if (!drawn.has(message)) drawn.set(message, []);
    drawn.get(message).push(element);
  }

  // What is told of a thing lies in its title; the page shows that itself.
  const told = new Map();
  for (const title of svg.querySelectorAll("title")) {
    told.set(title.parentNode, title.textContent);
    title.remove();
  }

  let lit = [], held = null;
  function dark() {
    for (const element of lit) element.classList.remove("lit", "core");
    lit = [];
    svg.classList.remove("focused");
  }
  function light(element) {
    dark();
    const message = element.dataset.m;
    if (message === "0") { // control traffic of no message
      lit = [element];
      element.classList.add("lit", "core");
    } else {
      const back = reached(message, causes), forward = reached(message, effects);
      for (const each of new Set([...back, ...forward])) {
        for (const part of drawn.get(each) || []) {
          const isLink = part.classList.contains("c");
          // Back all links belong to the chain, forward only those that come from something in it.
          const onWay = !isLink || back.has(each) || part.dataset.c.split(" ").some((cause) => forward.has(cause));
          if (!onWay) continue;
          part.classList.add("lit");
          if (each === message) part.classList.add("core");
          lit.push(part);
        }
      }
      tellChain(back.size - 1, forward.size - 1);
    }
    svg.classList.add("focused");
  }
  let chain = "";
  function tellChain(before, after) {
    chain = `\nchain: ${before} message${before === 1 ? "" : "s"} led to it, it led to ${after}`;
  }

  function pointed(event) {
    const group = event.target.closest ? event.target.closest("[data-m]") : null;
    return group && svg.contains(group) ? group : null;
  }
  function tell(event) {
    const group = pointed(event);
    const text = told.get(event.target) || (group && told.get(group)) || told.get(event.target.parentNode);
    tip.hidden = !text;
    if (!text) return;
    tip.textContent = text + (group && group.classList.contains("f") && !held && group.dataset.m !== "0" ? chain : "");
    const box = svg.getBoundingClientRect(), own = tip.getBoundingClientRect();
    const x = event.clientX - box.left + 16, y = event.clientY - box.top + 16;
    tip.style.left = `${Math.max(4, x + own.width > box.width ? x - own.width - 32 : x)}px`;
    tip.style.top = `${Math.max(4, y + own.height > box.height ? y - own.height - 32 : y)}px`;
  }
  svg.addEventListener("pointermove", (event) => {
    if (drag && drag.far) return;
    const group = pointed(event);
    if (!held) {
      if (group && !lit.includes(group)) light(group);
      else if (group && !group.classList.contains("core")) light(group);
      else if (!group && lit.length) dark();
    }
    tell(event);
  });
  svg.addEventListener("pointerleave", () => { tip.hidden = true; if (!held) dark(); });
  svg.addEventListener("click", (event) => {
    if (drag && drag.far) return;
    const group = pointed(event);
    held = group && held !== group.dataset.m ? group.dataset.m : null;
    if (group) light(group); else dark();
  });

  // The legend's switches: kinds, acknowledgements and wake-up frames, cause links.
  function concerned(name) {
    if (name.startsWith("kind-")) return `[data-k="${name.slice(5)}"]`;
    return name === "cause" ? ".c" : `.f.${name}`;
  }
  const off = new Set();
  for (const button of document.querySelectorAll(".switch")) {
    button.addEventListener("click", () => {
      const name = button.dataset.hides, shown = off.has(name);
      if (shown) off.delete(name); else off.add(name);
      button.setAttribute("aria-pressed", String(shown));
      for (const element of svg.querySelectorAll("[data-k]")) {
        element.classList.toggle("hidden", [...off].some((each) => element.matches(concerned(each))));
      }
    });
  }

  fit();
})();
