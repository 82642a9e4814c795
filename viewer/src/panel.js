// The lists and controls beside the canvas. All text goes in as text, never as markup.

import { RAMP_CSS } from "./data.js";

export function element(tag, className, text) {
  const e = document.createElement(tag);
  if (className) e.className = className;
  if (text !== undefined) e.textContent = text;
  return e;
}

function button(text, label, action) {
  const b = element("button", "", text);
  b.type = "button";
  b.title = label;
  b.setAttribute("aria-label", label);
  b.addEventListener("click", action);
  return b;
}

function slider(label, value, action) {
  const holder = element("label", "slider", label);
  const input = element("input");
  Object.assign(input, { type: "range", min: 0, max: 1, step: 0.005, value });
  input.addEventListener("input", () => action(Number(input.value)));
  holder.append(input);
  return { holder, input };
}

const MODES = [["together", "Assembled"], ["apart", "Exploded"], ["steps", "Step by step"]];

export function buildPanel(header, meshes, order, on) {
  const panel = document.getElementById("panel");
  const tools = document.getElementById("tools");
  const modes = element("div", "modes");
  const modeButtons = MODES.map(([mode, text]) => button(text, text, () => on.mode(mode)));
  modes.append(...modeButtons);
  const apart = slider("Spread", 0.8, on.apart);
  const steps = stepControls(meshes.length, on);
  const cut = cutControls(on);
  const paint = paintControls(header, on);
  const motions = motionControls(header, on);
  const sway = swayControls(on);
  const loads = loadList(header, on);
  const turn = button("Rotate", "Rotate the model continuously", on.turn);
  const view = element("div", "modes");
  view.append(turn, button("Reset", "Reset the view", on.home));
  tools.append(modes, apart.holder, steps.holder, cut.holder, paint.holder, ...motions.holders, sway.holder, view);
  panel.append(element("h1", "", header.title), summary(header));
  const list = meshList(header, meshes, order, on);
  const figures = (header.figures ?? []).map((figure) => section(figure.title, picture(figure)));
  const play = playTab(header);
  const pages = [
    { name: header.meshes_title, parts: [list.holder, header.notes.length && noteList(header, on)] },
    { name: "Strength", parts: [loads.holder, ...figures] },
    { name: "Play", parts: play },
    ...(header.tabs ?? []).map((tab) => ({ name: tab.name, parts: tab.parts.map(part) })),
    { name: "Checks", parts: [header.facts.length && section("Facts", table(header.facts)), header.checks.length && section("Checks", checkTable(header.checks))] },
  ].map(({ name, parts }) => ({ name, parts: parts.filter(Boolean) })).filter(({ parts }) => parts.length);
  const tabs = tabbed(pages);
  panel.append(tabs.holder);
  const look = lookControls(on);
  tools.insertBefore(look.holder, view);
  return {
    open: tabs.open,
    update(state, flying) {
      MODES.forEach(([mode], i) => modeButtons[i].setAttribute("aria-pressed", state.mode === mode));
      apart.holder.hidden = state.mode !== "apart";
      apart.input.value = state.apart;
      cut.input.value = state.cut;
      turn.setAttribute("aria-pressed", state.turning);
      paint.update(state);
      motions.update(state);
      sway.update(state);
      loads.update(state);
      steps.update(state, flying === undefined ? "" : meshes[flying].name);
      list.update(state, flying);
      look.update(state);
    },
  };
}

// Pages of which one shows; arrows go from button to button.
function tabbed(pages) {
  const holder = element("div");
  const bar = element("div", "tabs");
  bar.setAttribute("role", "tablist");
  const sheets = pages.map(({ name, parts }, i) => {
    const sheet = element("div", "sheet");
    Object.assign(sheet, { id: `sheet-${i}` });
    sheet.setAttribute("role", "tabpanel");
    sheet.setAttribute("aria-label", name);
    sheet.append(...parts);
    return sheet;
  });
  const buttons = pages.map(({ name }, i) => {
    const b = button(name, name, () => open(i));
    b.setAttribute("role", "tab");
    b.setAttribute("aria-controls", `sheet-${i}`);
    return b;
  });
  function open(i) {
    sheets.forEach((sheet, k) => { sheet.hidden = k !== i; });
    buttons.forEach((b, k) => { b.setAttribute("aria-selected", k === i); b.tabIndex = k === i ? 0 : -1; });
  }
  bar.addEventListener("keydown", (e) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[e.key];
    if (!by) return;
    e.preventDefault();
    e.stopPropagation();
    const next = (buttons.indexOf(document.activeElement) + by + buttons.length) % buttons.length;
    open(next);
    buttons[next].focus();
  });
  bar.append(...buttons);
  open(0);
  if (pages.length > 1) holder.append(bar);
  holder.append(...sheets);
  return { holder, open: (i) => pages[i] && open(i) };
}

// A part of a page: { table | text | picture | files: [title, content] }.
function part(of) {
  const [kind, [title, content]] = Object.entries(of)[0];
  if (kind === "table") return section(title, table(content));
  if (kind === "text") return section(title, ...content.map((line) => element("p", "line", line)));
  if (kind === "picture") return section(title, picture({ title, source: content }));
  const list = element("ul", "files");
  for (const [name, what] of content) {
    const item = element("li");
    const link = element("a", "", name);
    link.href = encodeURI(name);
    link.download = "";
    item.append(link, element("span", "", what));
    list.append(item);
  }
  return section(title, list);
}

// How far meshes move within their gaps, in words and figures.
function playTab(header) {
  const played = (header.quantities ?? []).filter((q) => /play/.test(q.name) && q.values.some((v) => v !== null));
  const rows = played.map((q) => [`largest ${q.name}`, `${Math.max(...q.values.filter((v) => v !== null)).toFixed(1)} ${q.unit}`]);
  if (!rows.length && !(header.motions ?? []).length) return [];
  const words = "Pieces need gaps to go together, so each one has a little play. Press \"shake\" below the model to see how far each piece moves while the others stay still.";
  return [section("Play", element("p", "line", words), table(rows))];
}

// Numbers on meshes, and measuring.
function lookControls(on) {
  const holder = element("div", "modes");
  const numbers = button("Numbers", "Show numbers on pieces", on.numbers);
  const measure = button("Measure", "Measure between two clicks", on.measure);
  holder.append(numbers, measure);
  return {
    holder,
    update(state) {
      numbers.setAttribute("aria-pressed", state.numbers);
      measure.setAttribute("aria-pressed", state.measuring);
    },
  };
}

function summary({ checks, notes }) {
  const line = element("p", "summary");
  const failed = checks.filter((c) => !c.ok).length;
  if (checks.length) {
    line.append(element("span", failed ? "pill bad" : "pill good", failed ? `${failed} of ${checks.length} checks FAIL` : `${checks.length} checks passed`));
  }
  for (const [severity, look] of [["problem", "bad"], ["warning", "warn"], ["note", "plain"]]) {
    const n = notes.filter((note) => (note.severity ?? "warning") === severity).length;
    if (n) line.append(element("span", `pill ${look}`, `${n} ${severity}${n === 1 ? "" : "s"}`));
  }
  return line;
}

function section(title, ...content) {
  const s = element("section");
  s.append(element("h2", "", title), ...content);
  return s;
}

// Small in the panel; a click shows it as large as the window.
function picture({ title, source }) {
  const image = element("img");
  image.src = source;
  image.alt = title;
  const large = element("dialog");
  const whole = element("img");
  whole.src = source;
  whole.alt = title;
  large.append(whole);
  large.addEventListener("click", () => large.close());
  const open = button("", `Enlarge ${title}`, () => large.showModal());
  open.className = "figure";
  open.append(image);
  const holder = element("div");
  holder.append(open, large);
  return holder;
}

function table(rows) {
  const t = element("table");
  for (const [name, value] of rows) {
    const row = t.insertRow();
    row.append(element("th", "", name), element("td", "", value));
  }
  return t;
}

function checkTable(checks) {
  const t = element("table", "checks");
  for (const { name, ok, figure } of checks) {
    const row = t.insertRow();
    row.append(element("td", ok ? "mark good" : "mark bad", ok ? "ok" : "FAIL"), element("th", "", name), element("td", "", figure));
  }
  return t;
}

function stepControls(count, on) {
  const holder = element("div", "steps");
  const playing = button("▶", "Play", on.play);
  const text = element("span", "count");
  const time = slider("", count, on.scrub);
  Object.assign(time.input, { max: count, step: 0.02, title: "Position in the assembly" });
  time.input.setAttribute("aria-label", time.input.title);
  holder.append(button("|◀", "First step", () => on.goTo(1)), button("◀", "Previous step", () => on.step(-1)), playing, button("▶|", "Next step", () => on.step(1)), time.holder, text);
  return {
    holder,
    update(state, name) {
      holder.hidden = state.mode !== "steps";
      playing.textContent = state.playing ? "❚❚" : "▶";
      time.input.value = state.step;
      text.textContent = `${Math.ceil(state.step)} / ${count}  ${name}`;
    },
  };
}

function cutControls(on) {
  let axis = 1;
  const cut = slider("Look inside", 0, (share) => on.cut(axis, share));
  const select = element("select");
  select.setAttribute("aria-label", "Direction of the cut");
  for (const [value, text] of [[1, "from the front"], [0, "from the side"], [2, "from above"]]) {
    const option = element("option", "", text);
    option.value = value;
    select.append(option);
  }
  select.addEventListener("change", () => { axis = Number(select.value); on.cut(axis, Number(cut.input.value)); });
  const holder = element("div", "cut");
  holder.append(cut.holder, select);
  return { holder, input: cut.input };
}

// What meshes are coloured by, and a legend where that is a quantity.
function paintControls(header, on) {
  const quantities = header.quantities ?? [];
  const holder = element("label", "paint", "Colour by");
  holder.hidden = !quantities.length;
  const select = element("select");
  [header.meshes_title.toLowerCase(), ...quantities.map((q) => q.name)].forEach((name, i) => {
    const option = element("option", "", name);
    option.value = i - 1;
    select.append(option);
  });
  select.addEventListener("change", () => on.paint(Number(select.value)));
  const legend = element("span", "legend");
  const [low, bar, high, none] = ["low", "ramp", "high", "none"].map((name) => element("span", name));
  bar.style.background = RAMP_CSS;
  legend.append(low, bar, high, none);
  holder.append(select, legend);
  return {
    holder,
    update({ paint, shades }) {
      select.value = paint;
      legend.hidden = !shades;
      if (!shades) return;
      const { unit } = quantities[paint];
      const text = (value) => (unit ? value.toFixed(2) : String(value));
      low.textContent = text(shades.low);
      high.textContent = `${text(shades.high)} ${unit}`;
      none.textContent = shades.hasGaps ? "grey: no value" : "";
    },
  };
}

// A button for each motion, and how large they show; nothing where there are none.
function motionControls(header, on) {
  const motions = header.motions ?? [];
  const buttons = motions.map(({ name, title }, i) => button(name, title, () => on.motion(i)));
  const large = button("×5", "Show the motion five times larger", on.magnify);
  const plays = element("div", "plays");
  plays.append(...buttons);
  const holder = element("div", "modes motions");
  holder.append(plays, large);
  return {
    holders: motions.length ? [holder] : [],
    update(state) {
      buttons.forEach((b, i) => b.setAttribute("aria-pressed", state.motion === i));
      large.setAttribute("aria-pressed", state.magnified);
    },
  };
}

// How much of a load shows, while one does.
function swayControls(on) {
  const holder = element("div", "steps sway");
  const playing = button("❚❚", "Play or pause", on.pause);
  const amount = slider("Load", 0, on.amount);
  amount.input.title = "Share of the load shown";
  amount.input.setAttribute("aria-label", amount.input.title);
  holder.append(playing, amount.holder);
  return {
    holder,
    update(state) {
      holder.hidden = state.load < 0;
      playing.textContent = state.swaying ? "❚❚" : "▶";
      amount.input.value = state.amount;
    },
  };
}

// What it bears: a button for each load, and one for what gives way first.
function loadList(header, on) {
  const { title, note, loads = [], weakest = null } = header.loads ?? {};
  if (!loads.length) return { holder: null, update: () => {} };
  const list = element("ul", "loads");
  const buttons = loads.map(({ name, figure, title: words }, i) => {
    const b = button("", words, () => on.load(i));
    b.append(element("span", "", name), element("strong", "", figure));
    const item = element("li");
    item.append(b);
    list.append(item);
    return b;
  });
  const parts = [list];
  const first = weakest && button("", "Show the place", on.weakest);
  if (first) {
    first.className = "weakest";
    first.append(element("strong", "", "Fails first"), element("span", "", weakest.text));
    parts.push(first);
  }
  if (note) parts.push(element("p", "remark", note));
  return {
    holder: section(title, ...parts),
    update(state) {
      buttons.forEach((b, i) => b.setAttribute("aria-pressed", state.load === i));
      first?.setAttribute("aria-pressed", state.isWeakest);
    },
  };
}

function meshList(header, meshes, order, on) {
  const list = element("ol", "meshes");
  const rows = new Map();
  for (const i of order) {
    const m = meshes[i];
    const row = element("li", "mesh");
    const pick = button("", `Select ${m.name}`, () => on.choose(row.classList.contains("chosen") ? -1 : i));
    pick.className = "pick";
    const dot = element("span", "dot");
    pick.append(dot, element("span", "name", m.name));
    if (m.badge) pick.append(element("span", "badge", m.badge));
    const eye = button("hide", `Hide or show ${m.name}`, () => on.toggle(i));
    eye.className = "eye";
    const details = element("div", "details");
    const only = button("Only this", `Show only ${m.name}`, on.alone);
    details.append(table(m.facts), only, button("From inside", `Look at the inner side of ${m.name}`, on.inside));
    row.append(pick, eye, details);
    row.addEventListener("pointerenter", () => on.hover(i));
    row.addEventListener("pointerleave", () => on.hover(-1));
    pick.addEventListener("focus", () => on.hover(i));
    pick.addEventListener("blur", () => on.hover(-1));
    list.append(row);
    rows.set(i, { row, eye, dot });
  }
  const holder = section(`${header.meshes_title} (${meshes.length})`, list, button("Show all", "Show all", on.showAll));
  return {
    holder,
    update(state, flying) {
      for (const [i, { row, eye, dot }] of rows) {
        dot.style.background = `rgb(${(state.shades?.colors[i] ?? meshes[i].color).join(",")})`;
        const chosen = state.chosen === i;
        if (chosen && !row.classList.contains("chosen")) row.scrollIntoView?.({ block: "nearest" });
        row.classList.toggle("chosen", chosen);
        row.classList.toggle("flying", flying === i);
        row.classList.toggle("hovered", state.hovered === i);
        row.classList.toggle("gone", state.hidden.has(i));
        eye.textContent = state.hidden.has(i) ? "show" : "hide";
      }
    },
  };
}

function noteList(header, on) {
  const list = element("ul", "notes");
  for (const note of header.notes) {
    const item = element("li", note.severity ?? "warning");
    const b = button("", note.at ? "Show the place" : note.title, () => on.note(note));
    const { severity = "warning" } = note;
    b.append(element("strong", "", `${severity[0].toUpperCase()}${severity.slice(1)}: ${note.title}`), element("span", "", note.text));
    item.append(b);
    list.append(item);
  }
  return section("Warnings and notes", list);
}
