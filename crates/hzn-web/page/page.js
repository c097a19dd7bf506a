// The page around hzn.wasm. It reads files of its own folder and the pictures that the user drops, and sends nothing.

const $ = (id) => document.getElementById(id);

// The module is asked in a worker, so that the page stays alive; a failed worker is replaced.
let worker = null;
let waiting = null;
function ask(request, picture) {
  if (!worker) {
    worker = new Worker("worker.js");
    worker.onmessage = ({ data }) => waiting.resolve(JSON.parse(data));
    worker.onerror = (event) => {
      worker.terminate();
      worker = null;
      waiting.resolve({ error: `the module stopped: ${event.message}` });
    };
  }
  return new Promise((resolve) => {
    waiting = { resolve };
    worker.postMessage({ line: JSON.stringify(request) + "\n", picture });
  });
}

let picture = null; // { name, bytes, bitmap }
let automatic = true;
let queued = null;
let busy = false;

// Runs one task after the other. Of several that wait, only the newest is done.
async function run(task) {
  queued = task;
  if (busy) return;
  busy = true;
  while (queued) {
    const next = queued;
    queued = null;
    try {
      await next();
    } catch (error) {
      say(String(error.message ?? error), "bad");
    }
  }
  busy = false;
}

function say(text, kind = "") {
  $("status").textContent = text;
  $("status").className = kind;
}

async function open(name, bytes) {
  picture = { name, bytes, bitmap: null, answer: null };
  clear();
  say("Reading the picture …");
  // As stored: the camera's own turn is not applied, because the pixels of the answer are those of the file.
  picture.bitmap = await createImageBitmap(new Blob([bytes]), { imageOrientation: "none" }).catch(() => null);
  if (!picture.bitmap) throw new Error(`${name}: is not a picture that this browser reads; give a PNG or JPEG`);
  draw(null);
  $("drop").classList.add("full");
  for (const id of ["write", "process", "level"]) $(id).disabled = false;
}

function refuse(why) {
  picture.answer = null;
  clear();
  draw(null);
  say(why, "bad");
}

function clear() {
  $("numbers").replaceChildren();
  $("notes").replaceChildren();
  $("explained").textContent = "";
  $("row").textContent = "";
  $("legend").hidden = true;
}

const number = (id) => ($(id).value.trim() === "" ? null : Number($(id).value));

async function writeSensor() {
  const request = { call: "start", name: picture.name, fov_deg: number("fov"), lens: $("lens").value || null, altitude_km: number("altitude") };
  const answer = await ask(request, picture.bytes);
  if (answer.error) return refuse(answer.error);
  $("toml").value = answer.sensor_toml;
  $("fov").placeholder = `${answer.fov_deg.toFixed(1)} from ${answer.from}`;
  automatic = true;
  await process(answer.warnings);
}

async function process(warnings = []) {
  const began = performance.now();
  const threshold = automatic ? null : Number($("level").value) / 255;
  const request = { call: "process", name: picture.name, sensor_toml: $("toml").value, threshold };
  const answer = await ask(request, picture.bytes);
  if (answer.error) return refuse(answer.error);
  picture.answer = answer;
  show(answer, warnings);
  const ms = Math.round(performance.now() - began);
  $("time").textContent = `${picture.name}: answered in ${ms} ms, ${Math.round(performance.now())} ms after this page was opened. `;
}

function show(answer, warnings) {
  const row = answer.rows[0];
  const ok = row.status === "ok";
  say(ok ? "ok: the limb is found" : `${row.status}: ${answer.meaning[0]}`, ok ? "ok" : "bad");
  const numbers = [];
  if (ok) {
    const [wide, narrow] = answer.sigma_deg;
    const vector = [row.axis_x, row.axis_y, row.axis_z].map((x) => x.toFixed(6)).join(", ");
    numbers.push(["Axis (x right, y down, z forward)", vector]);
    numbers.push(["Sigma of the direction", `${wide.toFixed(4)}° along ${answer.sigma_angle_deg.toFixed(0)}° from x, ${narrow.toFixed(4)}° across`]);
    numbers.push(["Half-angle of the fit", `${row.half_angle_deg.toFixed(3)}°`]);
    numbers.push(["Edge points", `${row.inliers} inliers, RMS ${row.rms_px.toFixed(3)} px`]);
  }
  $("numbers").replaceChildren(...numbers.flatMap(([name, value]) => [element("dt", name), element("dd", value)]));
  $("notes").replaceChildren(...[...warnings, ...answer.notes].map((note) => element("li", note)));
  $("explained").textContent = answer.explained;
  $("row").textContent = answer.rows.map((each) => JSON.stringify(each)).join("\n");
  $("legend").hidden = false;
  $("automatic").disabled = automatic;
  if (answer.level !== null) {
    const full = 2 ** answer.bits - 1;
    if (automatic) $("level").value = Math.round((answer.level / full) * 255);
    $("level-value").textContent = `${answer.level}`;
  }
  draw(answer);
}

function element(tag, text) {
  const made = document.createElement(tag);
  made.textContent = text;
  return made;
}

function draw(answer) {
  const canvas = $("canvas");
  const pen = canvas.getContext("2d");
  const { width, height } = picture.bitmap;
  canvas.width = width;
  canvas.height = height;
  pen.drawImage(picture.bitmap, 0, 0);
  if (!answer) return;
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(`--${name}`);
  // One unit is a pixel of the screen, whatever the size of the picture. Pixel centres are at whole numbers.
  const unit = Math.max(width / canvas.clientWidth, height / canvas.clientHeight);
  pen.save();
  pen.translate(0.5, 0.5);
  pen.lineJoin = "round";
  const line = (points, name, thick) => {
    pen.beginPath();
    points.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.strokeStyle = colour(name);
    pen.lineWidth = thick * unit;
    pen.stroke();
  };
  const dots = (points, name, radius) => {
    pen.fillStyle = colour(name);
    for (const [x, y] of points) {
      pen.beginPath();
      pen.arc(x, y, radius * unit, 0, 7);
      pen.fill();
    }
  };
  const { edges, inliers, rejected, limb, axes } = answer.drawing;
  edges.forEach((edge) => line(edge, "edge", 0.6));
  dots(rejected, "rejected", 1.8);
  limb.forEach((part) => line(part, "limb", 4));
  dots(inliers, "inlier", 1.1);
  axes.forEach(([x, y]) => {
    const arm = 12 * unit;
    pen.beginPath();
    for (const [dx, dy] of [[arm, 0], [0, arm]]) {
      pen.moveTo(x - dx, y - dy);
      pen.lineTo(x + dx, y + dy);
    }
    pen.strokeStyle = "#fff";
    pen.lineWidth = 2 * unit;
    pen.stroke();
    sigma(pen, answer, x + arm, y - 0.5 * arm, unit);
  });
  const [row] = answer.rows;
  if (axes.length === 0 && typeof row.picture_x === "number") {
    const [x, y] = arrow(pen, row, width, height, unit);
    sigma(pen, answer, x + 14 * unit, y, unit);
  }
  pen.restore();
}

// The direction to the body, from the middle of the picture, if the axis itself lies outside of it.
function arrow(pen, row, width, height, unit) {
  const [dx, dy] = [row.picture_x, row.picture_y];
  const long = 0.16 * Math.min(width, height);
  const [x, y] = [width / 2, height / 2];
  const [tx, ty] = [x + dx * long, y + dy * long];
  pen.strokeStyle = pen.fillStyle = "#fff";
  pen.lineWidth = 2 * unit;
  pen.beginPath();
  pen.moveTo(x, y);
  pen.lineTo(tx, ty);
  pen.stroke();
  pen.beginPath();
  pen.moveTo(tx + dx * 9 * unit, ty + dy * 9 * unit);
  pen.lineTo(tx - dy * 5 * unit, ty + dx * 5 * unit);
  pen.lineTo(tx + dy * 5 * unit, ty - dx * 5 * unit);
  pen.fill();
  return [tx, ty];
}

function sigma(pen, { sigma_deg }, x, y, unit) {
  if (!sigma_deg) return;
  pen.font = `${15 * unit}px system-ui, sans-serif`;
  pen.textBaseline = "middle";
  pen.lineWidth = 4 * unit;
  pen.strokeStyle = "#000";
  pen.fillStyle = "#fff";
  const text = `1σ: ${sigma_deg.map((deg) => `${deg.toFixed(4)}°`).join(" × ")}`;
  // A text that would leave the picture goes back, and below the arrow.
  const fits = pen.canvas.width - pen.measureText(text).width - 6 * unit;
  const place = x > fits ? [Math.max(0, fits), y + 24 * unit] : [x, y];
  pen.strokeText(text, ...place);
  pen.fillText(text, ...place);
}

async function openFile(file) {
  await open(file.name, new Uint8Array(await file.arrayBuffer()));
  if ($("toml").value.trim() && !number("fov") && !number("altitude")) return process();
  await writeSensor();
}

async function openExample({ file, sensor }) {
  const [bytes, text] = await Promise.all([
    fetch(`examples/${file}`).then((response) => response.arrayBuffer()),
    fetch(`examples/${sensor}`).then((response) => response.text()),
  ]);
  await open(file, new Uint8Array(bytes));
  for (const id of ["fov", "altitude", "lens"]) $(id).value = "";
  $("toml").value = text;
  automatic = true;
  await process();
}

async function main() {
  const examples = await fetch("examples/list.json").then((response) => response.json());
  for (const example of examples) {
    const button = element("button", "");
    button.type = "button";
    const image = document.createElement("img");
    image.src = `examples/${example.file}`;
    image.alt = "";
    image.loading = "lazy";
    button.title = `Picture: ${example.credit}`;
    button.append(image, element("span", example.title));
    button.onclick = () => run(() => openExample(example));
    $("examples").append(button);
  }
  $("file").onchange = () => $("file").files[0] && run(() => openFile($("file").files[0]));
  const drop = $("drop");
  document.ondragover = (event) => {
    event.preventDefault();
    drop.classList.add("over");
  };
  document.ondragleave = () => drop.classList.remove("over");
  document.ondrop = (event) => {
    event.preventDefault();
    drop.classList.remove("over");
    const file = event.dataTransfer.files[0];
    if (file) run(() => openFile(file));
  };
  $("camera").onsubmit = (event) => {
    event.preventDefault();
    run(writeSensor);
  };
  window.onresize = () => picture?.bitmap && draw(picture.answer);
  $("process").onclick = () => run(() => process());
  $("level").oninput = () => {
    automatic = false;
    run(() => process());
  };
  $("automatic").onclick = () => {
    automatic = true;
    run(() => process());
  };
  const first = examples.find(({ file }) => file === decodeURIComponent(location.hash.slice(1))) ?? examples[0];
  await run(() => openExample(first));
}

main();
