// Fields for options of a kit, as the server lists them.

import { element, field, select, text } from "./dom.js";
import { words } from "./words.js";

const usual = ({ default: value, choices }) => (value !== null ? words.open.usual(value) : choices.length ? words.open.ofPrinter : "");

// "key-grip" as "Key grip".
const spoken = (name) => { const plain = name.replaceAll("-", " "); return plain[0].toUpperCase() + plain.slice(1); };

/** One option as a field; `choose` is called with `{name: value}`. */
export function optionField(option, choose, label = words.option[option.name] ?? spoken(option.name)) {
  const { name, kind, value, help } = option;
  const set = (v) => choose({ [name]: v === "" ? null : v });
  let control;
  if (kind === "flag") {
    control = element("input");
    Object.assign(control, { type: "checkbox", checked: value === true });
    control.addEventListener("change", () => set(control.checked ? true : null));
  } else if (kind === "choice") {
    const none = option.default === null ? [["", words.open.ofPrinter]] : [];
    control = select([...none, ...option.choices.map((c) => [c, c])], value ?? option.default ?? "", (v) => set(v === option.default ? null : v));
  } else if (option.is_many) {
    control = element("textarea");
    Object.assign(control, { rows: 2, value: (value ?? []).join("\n"), placeholder: `${option.value_name}, ${words.open.several}` });
    control.addEventListener("change", () => set(control.value.split("\n").map((l) => l.trim()).filter(Boolean)));
  } else {
    control = text(value ?? "", usual(option) || option.value_name || "", set);
  }
  control.name = name;
  return field(label, control, help);
}

/** All options but those named in `shown`, in their groups, finer ones folded away. */
export function allOptions(options, choose, shown = []) {
  const holder = element("details", "all");
  holder.append(element("summary", "", words.open.all));
  for (const group of new Set(options.map((o) => o.group))) {
    const of = options.filter((o) => o.group === group && !shown.includes(o.name));
    if (!of.length) continue;
    const section = element("section");
    section.append(element("h3", "", group), ...of.filter((o) => !o.is_advanced).map((o) => optionField(o, choose)));
    const fine = of.filter((o) => o.is_advanced);
    if (fine.length) {
      const more = element("details");
      more.append(element("summary", "", words.open.advanced), ...fine.map((o) => optionField(o, choose)));
      section.append(more);
    }
    holder.append(section);
  }
  return holder;
}
