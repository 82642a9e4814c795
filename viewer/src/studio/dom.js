// Elements of the page. All text goes in as text, never as markup.

export function element(tag, className, text) {
  const e = document.createElement(tag);
  if (className) e.className = className;
  if (text !== undefined) e.textContent = text;
  return e;
}

export function button(text, action, { title, className, key } = {}) {
  const b = element("button", className, text);
  b.type = "button";
  if (title) b.title = key ? `${title} (${key})` : title;
  b.addEventListener("click", action);
  return b;
}

export function field(label, control, help) {
  const holder = element("label", "field");
  holder.append(element("span", "name", label), control);
  if (help) holder.append(element("span", "help", help));
  return holder;
}

export function select(values, chosen, action) {
  const s = element("select");
  for (const [value, text] of values) {
    const option = element("option", "", text);
    option.value = value;
    s.append(option);
  }
  s.value = chosen;
  s.addEventListener("change", () => action(s.value));
  return s;
}

export function text(value, placeholder, action) {
  const input = element("input");
  Object.assign(input, { type: "text", value, placeholder, spellcheck: false });
  input.addEventListener("change", () => action(input.value.trim()));
  return input;
}

export function slider(label, { min, max, step, value }, action) {
  const holder = element("label", "slider");
  const input = element("input");
  const told = element("output", "", String(value));
  Object.assign(input, { type: "range", min, max, step, value });
  input.addEventListener("input", () => { told.textContent = input.value; action(Number(input.value)); });
  holder.append(element("span", "", label), input, told);
  return { holder, set: (x) => { input.value = x; told.textContent = input.value; } };
}
