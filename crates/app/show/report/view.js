"use strict";
// The turning view of the designed body: its boundary between the initial and the best shape, coloured by values at its
// nodes. Data: see surface.rs. Nothing is loaded, nothing is stored.
(function () {
  const figure = document.getElementById("view");
  const holder = document.getElementById("surface");
  if (!figure || !holder) return;
  const canvas = figure.querySelector("canvas");
  const stage = figure.querySelector(".stage");
  const controls = figure.querySelector(".controls");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true, preserveDrawingBuffer: true });
  if (!gl) return;
  const data = JSON.parse(holder.textContent);

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const words = (text) => new Uint16Array(bytes(text).buffer);

  const VERTEX = `#version 300 es
    in vec3 before; in vec3 after; in float first; in float second;
    uniform vec3 low, size, middle, turn, shift, right, up, out_of;
    uniform float shape, grow; uniform vec4 pose; uniform vec2 lens, centre;
    out vec3 place; out float value; out float known;
    void main() {
      vec3 x = low + size * (before + (after - before) * shape * grow);
      x = x * turn + shift - middle;
      vec3 q = vec3(dot(right, x), dot(up, x), dot(out_of, x));
      q = vec3(q.x * pose.x + q.z * pose.y, q.y, q.z * pose.x - q.x * pose.y);
      q = vec3(q.x, q.y * pose.z - q.z * pose.w, q.z * pose.z + q.y * pose.w);
      place = q;
      known = (first > 0.99999 || second > 0.99999) ? 0.0 : 1.0;
      value = mix(first, second, shape);
      float away = 3.2 - q.z;
      gl_Position = vec4(q.x * lens.x - centre.x * away, q.y * lens.y - centre.y * away, (away - 3.2) * 0.45 * away / 3.2, away);
    }`;
  const FILL = `#version 300 es
    precision highp float;
    in vec3 place; in float value; in float known;
    uniform sampler2D map; uniform vec3 blank;
    out vec4 colour;
    void main() {
      vec3 n = normalize(cross(dFdx(place), dFdy(place)));
      if (n.z < 0.0) n = -n;
      float light = 0.5 + 0.34 * max(dot(n, normalize(vec3(-0.45, 0.75, 0.6))), 0.0) + 0.24 * n.z;
      vec3 base = known > 0.999 ? texture(map, vec2(value * (65535.0 / 65534.0), 0.5)).rgb : blank;
      colour = vec4(base * min(light, 1.06), 1.0);
    }`;
  const LINE = `#version 300 es
    precision highp float;
    in vec3 place; in float value; in float known;
    out vec4 colour;
    void main() { colour = vec4(0.0, 0.0, 0.0, 0.2); }`;

  function program(fragment) {
    const own = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source.trim());
      gl.compileShader(shader);
      gl.attachShader(own, shader);
    }
    ["before", "after", "first", "second"].forEach((name, i) => gl.bindAttribLocation(own, i, name));
    gl.linkProgram(own);
    if (!gl.getProgramParameter(own, gl.LINK_STATUS)) return null;
    const places = {};
    const uniform = (name) => places[name] || (places[name] = gl.getUniformLocation(own, name));
    return { own, uniform };
  }
  const fill = program(FILL);
  const line = program(LINE);
  if (!fill || !line) return;

  function attribute(slot, values, parts) {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(slot);
    gl.vertexAttribPointer(slot, parts, gl.UNSIGNED_SHORT, true, 2 * parts, 0);
  }
  // Vertices of three numbers of two bytes are padded to four: some drivers want it so.
  function padded(values) {
    const wide = new Uint16Array(values.length / 3 * 4);
    for (let i = 0; i < values.length / 3; i++) wide.set(values.subarray(3 * i, 3 * i + 3), 4 * i);
    return wide;
  }
  [data.before, data.after].forEach((text, slot) => {
    attribute(slot, padded(words(text)), 4);
    gl.vertexAttribPointer(slot, 3, gl.UNSIGNED_SHORT, true, 8, 0);
  });
  const raw = bytes(data.triangles);
  const triangles = data.wide ? new Uint32Array(raw.buffer) : Uint32Array.from(new Uint16Array(raw.buffer));
  const edges = (function () {
    const seen = new Set();
    const list = [];
    for (let t = 0; t < triangles.length; t += 3) {
      for (let k = 0; k < 3; k++) {
        const a = triangles[t + k], b = triangles[t + (k + 1) % 3];
        const key = Math.min(a, b) * data.nodes + Math.max(a, b);
        if (!seen.has(key)) { seen.add(key); list.push(a, b); }
      }
    }
    return Uint32Array.from(list);
  })();
  const faceBuffer = gl.createBuffer();
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, faceBuffer);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
  const edgeBuffer = gl.createBuffer();
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, edgeBuffer);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, edges, gl.STATIC_DRAW);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);

  // The way that the surface looks points upwards; what is longest lies to the right.
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const scaled = (a, s) => a.map((c) => c * s);
  const unit = (a) => scaled(a, 1 / Math.hypot(...a));
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const size = data.low.map((low, d) => data.high[d] - low);
  const up = unit(data.up);
  const right = (function () {
    let best = [0, 0, 0], length = -1;
    for (let d = 0; d < 3; d++) {
      const axis = [0, 0, 0];
      axis[d] = 1;
      const flat = axis.map((c, k) => c - up[d] * up[k]);
      if (Math.hypot(...flat) > 0.1 && size[d] > length * 1.0001) { best = unit(flat); length = size[d]; }
    }
    return best;
  })();
  const outOf = cross(right, up);

  const START = { yaw: 0.62, pitch: 0.72, zoom: 1 };
  const state = { ...START, shape: 1, colour: 0, lines: true, images: data.mirrors.length > 0 };
  let waiting = false;
  function redraw() {
    if (!waiting) { waiting = true; requestAnimationFrame(draw); }
  }

  function images() {
    const all = [];
    const count = state.images ? 1 << data.mirrors.length : 1;
    for (let set = 0; set < count; set++) {
      const turn = [1, 1, 1], shift = [0, 0, 0];
      data.mirrors.forEach(([axis, at], k) => {
        if (set >> k & 1) { turn[axis] = -1; shift[axis] = 2 * at; }
      });
      all.push({ turn, shift });
    }
    return all;
  }

  // The box around all images.
  function box() {
    const low = [...data.low], high = [...data.high];
    if (state.images) {
      for (const [axis, at] of data.mirrors) {
        const other = [2 * at - high[axis], 2 * at - low[axis]];
        low[axis] = Math.min(low[axis], other[0]);
        high[axis] = Math.max(high[axis], other[1]);
      }
    }
    return { low, high, middle: low.map((l, d) => 0.5 * (l + high[d])), radius: 0.5 * Math.hypot(...low.map((l, d) => high[d] - l)) };
  }

  const posed = ({ yaw, pitch }) => [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];

  // How large and where the box is when it is first seen: it fills the stage but for a margin.
  function fit(s, middle, aspect) {
    const { low, high } = box();
    const [cy, sy, cp, sp] = posed(START);
    const left = [Infinity, Infinity], most = [-Infinity, -Infinity];
    for (let corner = 0; corner < 8; corner++) {
      const x = low.map((l, d) => s * ((corner >> d & 1 ? high[d] : l) - middle[d]));
      const q = [dot(right, x), dot(up, x), dot(outOf, x)];
      const z = q[2] * cy - q[0] * sy;
      const place = [q[0] * cy + q[2] * sy, q[1] * cp - z * sp];
      const away = 3.2 - (z * cp + q[1] * sp);
      place.forEach((p, k) => {
        left[k] = Math.min(left[k], p / away);
        most[k] = Math.max(most[k], p / away);
      });
    }
    const half = [0.5 * (most[0] - left[0]), 0.5 * (most[1] - left[1])];
    const room = 0.9;
    const reach = room * Math.min(1 / (half[0] * Math.min(1, 1 / aspect)), 1 / (half[1] * Math.min(1, aspect)));
    return { reach, centre: [0.5 * (left[0] + most[0]), 0.5 * (left[1] + most[1])] };
  }

  function draw() {
    waiting = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 2.5);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const { middle, radius } = box();
    const s = 1 / radius;
    const { reach, centre } = fit(s, middle, width / height);
    const lens = [reach * state.zoom * Math.min(1, height / width), reach * state.zoom * Math.min(1, width / height)];
    const pose = posed(state);
    const pass = ({ own, uniform }, buffer, count, mode) => {
      gl.useProgram(own);
      gl.uniform3fv(uniform("low"), scaled(data.low, s));
      gl.uniform3fv(uniform("size"), scaled(size, s));
      gl.uniform3fv(uniform("middle"), scaled(middle, s));
      gl.uniform3fv(uniform("right"), right);
      gl.uniform3fv(uniform("up"), up);
      gl.uniform3fv(uniform("out_of"), outOf);
      gl.uniform1f(uniform("shape"), state.shape);
      gl.uniform1f(uniform("grow"), data.exaggeration);
      gl.uniform4fv(uniform("pose"), pose);
      gl.uniform2fv(uniform("lens"), lens);
      gl.uniform2fv(uniform("centre"), centre.map((c, k) => c * lens[k]));
      if (uniform("blank")) gl.uniform3fv(uniform("blank"), [0.62, 0.64, 0.66]);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      for (const { turn, shift } of images()) {
        gl.uniform3fv(uniform("turn"), turn);
        gl.uniform3fv(uniform("shift"), scaled(shift, s));
        gl.drawElements(mode, count, gl.UNSIGNED_INT, 0);
      }
    };
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    pass(fill, faceBuffer, triangles.length, gl.TRIANGLES);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    if (state.lines) pass(line, edgeBuffer, edges.length, gl.LINES);
    drawTriad(pose);
  }

  // Names of the axes in a corner.
  const SVG = document.createElementNS.bind(document, document.querySelector("svg") ? document.querySelector("svg").namespaceURI : null);
  const triad = SVG("svg");
  triad.setAttribute("class", "triad");
  triad.setAttribute("viewBox", "-38 -38 76 76");
  triad.setAttribute("aria-hidden", "true");
  const arms = ["x", "y", "z"].map((name) => {
    const path = SVG("path"), label = SVG("text");
    label.textContent = name;
    triad.append(path, label);
    return { path, label };
  });
  function drawTriad([cy, sy, cp, sp]) {
    arms.forEach(({ path, label }, d) => {
      const q = [right[d], up[d], outOf[d]];
      const x = q[0] * cy + q[2] * sy, z = q[2] * cy - q[0] * sy;
      const y = q[1] * cp - z * sp;
      path.setAttribute("d", `M0 0L${(22 * x).toFixed(1)} ${(-22 * y).toFixed(1)}`);
      label.setAttribute("x", (31 * x).toFixed(1));
      label.setAttribute("y", (-31 * y).toFixed(1));
    });
  }

  // Legend and colours.
  const legend = document.createElement("div");
  legend.className = "legend";
  const number = (v) => Number(v.toPrecision(3)).toString().replace("-", "\u2212");
  function choose(index) {
    state.colour = index;
    const colour = data.colours[index];
    if (!colour) return;
    attribute(2, words(colour.before), 1);
    attribute(3, words(colour.after), 1);
    const map = bytes(colour.map);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, map.length / 3, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, map);
    const stops = [];
    for (let i = 0; i <= 12; i++) {
      const k = 3 * Math.round(i / 12 * (map.length / 3 - 1));
      stops.push(`rgb(${map[k]},${map[k + 1]},${map[k + 2]})`);
    }
    const middle = colour.logarithmic ? Math.sqrt(colour.low * colour.high) : 0.5 * (colour.low + colour.high);
    legend.replaceChildren();
    const title = document.createElement("span");
    title.textContent = `${colour.name} [${colour.unit}]`;
    const bar = document.createElement("i");
    bar.style.background = `linear-gradient(to right, ${stops.join(",")})`;
    const row = document.createElement("div");
    for (const value of [colour.low, middle, colour.high]) {
      const label = document.createElement("span");
      label.textContent = number(value);
      row.append(label);
    }
    legend.append(title, bar, row);
    redraw();
  }

  function control(text, kind, set) {
    const label = document.createElement("label");
    const input = document.createElement(kind);
    set(input);
    if (kind === "input" && input.type === "checkbox") label.append(input, text); else label.append(text, input);
    controls.append(label);
    return input;
  }
  control("Colour", "select", (input) => {
    data.colours.forEach((colour, i) => {
      const option = document.createElement("option");
      option.value = i;
      option.textContent = colour.name;
      input.append(option);
    });
    input.addEventListener("change", () => choose(Number(input.value)));
  });
  const slider = control("Initial", "input", (input) => {
    Object.assign(input, { type: "range", min: 0, max: 1, step: 0.01, value: 1 });
    input.setAttribute("aria-label", "Shape between the initial and the best one");
    input.addEventListener("input", () => { stop(); state.shape = Number(input.value); redraw(); });
  });
  slider.parentNode.append("best");
  const rests = data.before === data.after;
  slider.parentNode.hidden = rests;
  let playing = 0;
  function stop() { cancelAnimationFrame(playing); playing = 0; }
  const play = document.createElement("button");
  play.type = "button";
  play.textContent = "Play";
  play.addEventListener("click", () => {
    stop();
    const begin = performance.now();
    const step = (now) => {
      const t = Math.min(1, Math.max(0, (now - begin) / 2200));
      state.shape = t * t * (3 - 2 * t);
      slider.value = state.shape;
      redraw();
      playing = t < 1 ? requestAnimationFrame(step) : 0;
    };
    playing = requestAnimationFrame(step);
  });
  play.hidden = rests;
  controls.append(play);
  control("Mesh lines", "input", (input) => {
    Object.assign(input, { type: "checkbox", checked: state.lines });
    input.addEventListener("change", () => { state.lines = input.checked; redraw(); });
  });
  if (data.mirrors.length > 0) {
    control("Mirrored", "input", (input) => {
      Object.assign(input, { type: "checkbox", checked: state.images });
      input.addEventListener("change", () => { state.images = input.checked; redraw(); });
    });
  }

  // Turning and zooming.
  function turn(dx, dy) {
    state.yaw += dx;
    state.pitch = Math.max(-1.57, Math.min(1.57, state.pitch + dy));
    redraw();
  }
  function zoom(factor) {
    state.zoom = Math.max(0.4, Math.min(8, state.zoom * factor));
    redraw();
  }
  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener("pointerdown", (event) => {
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const apart = fingers.size === 2 ? spread() : 0;
    const now = { x: event.clientX, y: event.clientY };
    fingers.set(event.pointerId, now);
    if (fingers.size === 2) zoom(spread() / Math.max(1, apart));
    else turn(0.009 * (now.x - last.x), 0.009 * (now.y - last.y));
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
  }
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-0.0012 * event.deltaY));
  }, { passive: false });
  const KEYS = {
    ArrowLeft: () => turn(-0.12, 0), ArrowRight: () => turn(0.12, 0), ArrowUp: () => turn(0, -0.12), ArrowDown: () => turn(0, 0.12),
    "+": () => zoom(1.12), "=": () => zoom(1.12), "-": () => zoom(1 / 1.12),
    Home: () => { Object.assign(state, START); redraw(); },
  };
  canvas.addEventListener("keydown", (event) => {
    const action = KEYS[event.key];
    if (action) { event.preventDefault(); action(); }
  });
  canvas.addEventListener("webglcontextlost", () => { figure.classList.remove("ready"); controls.hidden = true; });

  stage.append(triad, legend);
  controls.hidden = false;
  figure.classList.add("ready");
  choose(0);
  new ResizeObserver(redraw).observe(canvas);
  window.addEventListener("beforeprint", draw);
  draw();
})();
