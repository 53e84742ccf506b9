const SECONDS = 10, RATE_SECONDS = 2, FRICTION = 0.5, SHADES = 20;
const { rows, cols, pitch_mm: [pitchX, pitchY] } = KNOWN;
const HIGH = pitchY / pitchX; // height of a cell; its width is 1
const at = id => document.getElementById(id);
const text = (element, content) => { if (element.textContent !== content) element.textContent = content; };
const svg = (parent, name, attributes = {}) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return parent.appendChild(element);
};
const place = ([x, y]) => [x / pitchX + cols / 2, y / pitchX + rows * HIGH / 2];
const digits = value => Number(value).toPrecision(3);

/** Path of an arrow. */
function arrow(x, y, dx, dy, head) {
  const length = Math.hypot(dx, dy), k = Math.min(head, length) / (length || 1);
  const side = s => `L${(x + dx - k * (dx + s * dy)).toFixed(3)} ${(y + dy - k * (dy - s * dx)).toFixed(3)}`;
  const tip = `${(x + dx).toFixed(3)} ${(y + dy).toFixed(3)}`;
  return `M${x.toFixed(3)} ${y.toFixed(3)}L${tip}${side(0.6)}M${tip}${side(-0.6)}`;
}

/** A map of the array: stress as colours, forces of taxels as arrows, contacts as thick ones with error bars. */
class ArrayMap {
  constructor(figure) {
    this.svg = figure.querySelector("svg");
    this.svg.setAttribute("viewBox", `0 0 ${cols} ${rows * HIGH}`);
    // One path for all cells of a shade: an element per cell takes the browser several times as long.
    this.shades = ["minus", "plus"].map(sign => Array.from({ length: SHADES }, (_, k) =>
      svg(this.svg, "path", { class: sign, "fill-opacity": (k + 1) / SHADES })));
    const lines = (count, line) => Array.from({ length: count + 1 }, (_, k) => line(k)).join("");
    svg(this.svg, "path", { class: "grid", d: lines(cols, c => `M${c} 0v${rows * HIGH}`)
      + lines(rows, r => `M0 ${r * HIGH}h${cols}`) });
    // The first taxel, row 0 and column 0, with the axes from its centre.
    const [x, y, long] = [0.5, 0.5 * HIGH, Math.min(1.5, cols - 0.5, (rows - 0.5) * HIGH)];
    svg(this.svg, "circle", { class: "first", cx: x, cy: y, r: 0.12 });
    svg(this.svg, "path", { class: "axes", d: arrow(x, y, long, 0, 0.25) + arrow(x, y, 0, long, 0.25) });
    for (const [axis, at] of [["x", [x + long, y - 0.1]], ["y", [x + 0.12, y + long]]]) {
      text(svg(this.svg, "text", { class: "axis", x: at[0], y: at[1], "font-size": 0.45 }), axis);
    }
    this.missing = svg(this.svg, "path", { class: "missing" });
    this.trails = svg(this.svg, "path", { class: "trails" });
    this.arrows = svg(this.svg, "path", { class: "arrows" });
    this.contact = svg(this.svg, "path", { class: "contact" });
    this.bars = svg(this.svg, "path", { class: "bars" });
  }

  draw(stress, peak, forces, longest, contacts, largest, trails = "") {
    this.trails.setAttribute("d", trails);
    const cells = this.shades.map(sign => sign.map(() => ""));
    let crosses = "";
    for (let k = 0; k < stress.length; k++) {
      if (stress[k] === null) crosses += `M${k % cols} ${Math.floor(k / cols) * HIGH}l1 ${HIGH}m-1 0l1 ${-HIGH}`;
      const share = peak > 0 ? stress[k] / peak : 0;
      // The square root makes small values visible, in particular tension.
      const shade = Math.round(SHADES * Math.sqrt(Math.min(1, Math.abs(share))));
      if (shade > 0) cells[share > 0 ? 1 : 0][shade - 1] += `M${k % cols} ${Math.floor(k / cols) * HIGH}h1v${HIGH}h-1`;
    }
    this.shades.forEach((sign, s) => sign.forEach((path, k) => path.setAttribute("d", cells[s][k])));
    this.missing.setAttribute("d", crosses);
    let path = "";
    for (let k = 0; k < (forces.fx || []).length; k++) {
      const [fx, fy] = [forces.fx[k], forces.fy[k]];
      if (longest > 0 && Math.hypot(fx, fy) > 0.03 * longest) {
        path += arrow(k % cols + 0.5, (Math.floor(k / cols) + 0.5) * HIGH, fx / longest, fy / longest, 0.3);
      }
    }
    this.arrows.setAttribute("d", path);
    let [thick, bars] = ["", ""];
    const scale = largest > 0 ? 0.3 * cols / largest : 0;
    for (const { centre_mm: centre, force_N: force, shear_sigma_N: sigma } of contacts) {
      if (!centre) continue;
      const [x, y] = place(centre), tip = [x + scale * force[0], y + scale * force[1]];
      thick += arrow(x, y, tip[0] - x, tip[1] - y, 0.6);
      if (sigma) {
        const [sx, sy] = [scale * sigma[0], scale * sigma[1]];
        bars += `M${tip[0] - sx} ${tip[1]}h${2 * sx}M${tip[0]} ${tip[1] - sy}v${2 * sy}`;
      }
    }
    this.contact.setAttribute("d", thick);
    this.bars.setAttribute("d", bars);
  }
}

const found = new ArrayMap(at("found")), real = new ArrayMap(at("true"));
let history = []; // of the last seconds: when drawn, when received, number, forces, peaks

function table(picture, contacts) {
  const bars = c => [...(c.shear_sigma_N || [null, null]), c.normal_sigma_N];
  const rows = contacts.map((c, k) => [`contact ${k + 1}`, c.force_N, bars(c)]);
  rows.push(["found, sum", picture.result.resultant_N]);
  if (picture.truth) rows.push(["true, sum", picture.truth.resultant_N]);
  const body = at("forces");
  while (body.rows.length > rows.length) body.deleteRow(-1);
  rows.forEach(([name, force, sigma], k) => {
    const row = body.rows[k] || body.insertRow();
    [name, ...force.map((f, axis) => f.toFixed(3) + (sigma && sigma[axis] != null ? ` ± ${sigma[axis].toFixed(3)}` : ""))]
      .forEach((content, column) => text(row.cells[column] || row.insertCell(), content));
  });
}

/** Where the contacts of the newest result have been in the last seconds. */
function trails(tracks) {
  const trail = ({ number }) => history.flatMap(h => h.tracks.filter(([own]) => own === number).map(([, x, y]) => [x, y]));
  return tracks.map(track => trail(track).map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("")).join("");
}

/** What is known of the contacts over time; `period` is that of the results in s. */
function tell(tracks, period) {
  text(at("tracks"), tracks.map(t => {
    const speed = Math.hypot(...t.velocity_mm) / period;
    const ratio = t.load_ratio.toFixed(2) + (t.load_ratio_sigma == null ? "" : ` ± ${t.load_ratio_sigma.toFixed(2)}`);
    return `contact ${t.number}, for ${(t.age * period).toFixed(1)} s: ${t.moving ? "moves, " : ""}${speed.toFixed(1)} mm/s, shear over normal `
      + `force ${ratio}` + (t.slip_ratio == null ? "" : `, before it last moved up to ${t.slip_ratio.toFixed(2)}`);
  }).join("; "));
}

const plot = at("plot"), lines = {};
for (const y of [10, 80, 150]) svg(plot, "line", { x1: 46, x2: 598, y1: y, y2: y });
const marks = [14, 84, 150].map(y => svg(plot, "text", { x: 2, y }));
for (const kind of ["true", "found"]) {
  lines[kind] = ["x", "y", "z"].map(axis => svg(plot, "polyline", { class: `${axis} ${kind}` }));
}

function drawPlot(now) {
  const all = history.flatMap(h => [...h.found, ...(h.true || [])]);
  const low = Math.min(0, ...all), high = Math.max(low + 1e-3, ...all);
  [high, (low + high) / 2, low].forEach((value, k) => text(marks[k], digits(value)));
  for (const [kind, three] of Object.entries(lines)) {
    const known = history.filter(h => h[kind]);
    three.forEach((line, axis) => line.setAttribute("points", known.map(h =>
      `${Math.round(598 - 552 * (now - h.drawn) / SECONDS)},${(150 - 140 * (h[kind][axis] - low) / (high - low)).toFixed(1)}`)
      .join(" ")));
  }
}

const lengths = forces => (forces.fx || []).map((fx, k) => Math.hypot(fx, forces.fy[k]));
const most = values => values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);

/** Draws a picture; the time is in seconds. */
function draw(picture, now) {
  const { result, truth, contacts, stress_MPa: stress } = picture;
  const tracks = result.tracks || [];
  const sums = [result.resultant_N, ...contacts.map(c => c.force_N), ...(truth ? [truth.resultant_N] : [])];
  history.push({
    drawn: now, received: picture.received_s, sequence: picture.sequence,
    found: result.resultant_N, true: truth && truth.resultant_N, peak: most(stress),
    tracks: tracks.map(t => [t.number, ...place(t.centre_mm)]),
    longest: most([...lengths(result.forces_N), ...lengths(truth || {})]),
    largest: most(sums.map(([x, y]) => Math.hypot(x, y))),
  });
  history = history.filter(h => now - h.drawn <= SECONDS);
  const [peak, longest, largest] = ["peak", "longest", "largest"].map(key => most(history.map(h => h[key])));
  found.draw(stress, peak, result.forces_N, longest, contacts, largest, trails(tracks));
  at("true").hidden = at("dashed").hidden = !truth;
  if (truth) real.draw(stress, peak, truth, longest, [], largest);
  text(at("scale"), `Full colour ${digits(peak)} MPa: pressure red, tension blue. Longest thin arrow ${digits(longest)} N, `
    + `a taxel's tangential force; thick arrow: a contact's, up to ${digits(largest)} N, with one standard deviation. `
    + `Thin line: where a contact was in the last ${SECONDS} s. Scales: the largest of the last ${SECONDS} s. Dot: the first taxel, row 0 and column 0; x to the right, y down, `
    + `normal forces positive in pressure.`);
  table(picture, contacts);
  const [first, last] = [history[0], history.at(-1)], count = last.sequence - first.sequence;
  tell(tracks, count > 0 ? (last.received - first.received) / count : NaN);
  const flags = result.flags.join();
  if (at("flags").dataset.flags !== flags) {
    at("flags").dataset.flags = flags;
    at("flags").replaceChildren(...result.flags.map(flag => {
      const chip = document.createElement("span");
      chip.textContent = flag;
      // A sensor at rest is no alarm.
      chip.classList.toggle("rest", result.flags.includes("no-contact"));
      return chip;
    }));
  }
  drawPlot(now);
}

/** Rates over the last two seconds, times of the newest picture. */
function state(picture, now, drawing) {
  const recent = history.filter(h => now - h.drawn <= RATE_SECONDS), [first, last] = [recent[0], recent.at(-1)];
  const per = (count, seconds) => seconds > 0 ? (count / seconds).toFixed(1) : "–";
  text(at("state"), `frame ${picture.sequence} · ${picture.result.engine}, ${picture.estimator} · `
    + `${per(last.sequence - first.sequence, last.received - first.received)} results/s · `
    + `${per(recent.length - 1, last.drawn - first.drawn)} drawn/s · `
    + `reconstruction ${(1e3 * (picture.answered_s - picture.received_s)).toFixed(1)} ms · `
    + `frame to screen ${(1e3 * (Date.now() / 1e3 - picture.received_s)).toFixed(0)} ms · `
    + `drawing ${drawing.toFixed(1)} ms · ${picture.dropped} dropped · ${picture.refused} refused`
    + (picture.refusal ? ` (${picture.refusal})` : ""));
}

async function follow() {
  for (let seen = 0; ;) {
    await new Promise(requestAnimationFrame);
    try {
      const answer = await fetch(`/newest?after=${seen}`);
      if (answer.status === 204) continue;
      if (!answer.ok) throw new Error(await answer.text());
      seen = Number(answer.headers.get("Number"));
      const picture = await answer.json(), begun = performance.now();
      draw(picture, begun / 1e3);
      document.body.getBoundingClientRect(); // the browser's layout is part of the time
      state(picture, begun / 1e3, performance.now() - begun);
    } catch (error) {
      text(at("state"), `no connection to dermis live (${error.message}); trying again`);
      await new Promise(done => setTimeout(done, 1000));
    }
  }
}

/** Words on a map until they are removed. */
function hint(map, words) {
  const shown = svg(map.svg, "text", { class: "hint", x: cols / 2, y: rows * HIGH * 0.93, "font-size": cols / 16 });
  text(shown, words);
  return shown;
}

/** The mouse as finger: sticks where it is pressed until the drag reaches the friction, then slides after the mouse. */
function finger() {
  const reach = 0.25 * Math.min(cols * pitchX, rows * pitchY), slider = at("press").querySelector("input");
  let [pressed, mouse, stuck, sent, busy] = [false, [0, 0], [0, 0], "null", false];
  const send = async () => {
    const normal = Number(slider.value), force = stuck.map((s, axis) => FRICTION * normal * (mouse[axis] - s) / reach);
    const wanted = JSON.stringify(pressed ? { centre_mm: stuck, force_N: [...force, normal] } : null);
    text(at("press").querySelector("output"), `${normal.toFixed(1)} N`);
    if (busy || wanted === sent) return;
    busy = true;
    try {
      await fetch("/finger", { method: "POST", body: sent = wanted });
    } catch {
      sent = ""; // follow() reports it
    }
    busy = false;
    // What the mouse did meanwhile.
    if (sent) send();
  };
  const move = event => {
    const box = found.svg.getScreenCTM().inverse(), p = new DOMPoint(event.clientX, event.clientY).matrixTransform(box);
    const within = (value, most) => Math.min(Math.max(value, 0), most);
    mouse = [(within(p.x, cols) - cols / 2) * pitchX, (within(p.y, rows * HIGH) - rows * HIGH / 2) * pitchX];
  };
  const follow = () => {
    const away = Math.hypot(mouse[0] - stuck[0], mouse[1] - stuck[1]);
    if (away > reach) stuck = stuck.map((s, axis) => mouse[axis] - (mouse[axis] - s) * reach / away);
    send();
  };
  found.svg.classList.add("finger");
  const words = hint(found, "press here and drag");
  found.svg.addEventListener("pointerdown", event => {
    words.remove();
    found.svg.setPointerCapture(event.pointerId);
    move(event);
    [pressed, stuck] = [true, mouse];
    send();
  });
  found.svg.addEventListener("pointermove", event => { if (pressed) { move(event); follow(); } });
  for (const end of ["pointerup", "pointercancel"]) found.svg.addEventListener(end, () => { pressed = false; send(); });
  slider.addEventListener("input", send);
  at("press").hidden = false;
  send();
}

if (KNOWN.finger) finger();
follow();
