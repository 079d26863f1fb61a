// Plays recorded episodes on a canvas, all on the page by one clock, so that they can be compared.
//
// With `controls` it is the bar that starts, stops and moves that clock, and draws nothing.
const COLOURS = {
  ground: "#eceef0", stripe: "#d9dde1", mark: "#767676", body: "#3c3c3c", hind: "#0072B2", fore: "#E69F00", goal: "#D55E00",
};
const HOLD = 1.5; // seconds on the last frame, before all begin again

const clock = (window.jmorlClock ??= startClock());

// It ticks only while there is something to play, or after `wake`: drawing takes a processor that may be training.
function startClock() {
  const clock = {
    time: 0,
    playing: !window.matchMedia("(prefers-reduced-motion: reduce)").matches,
    shown: new Set(), // components: `duration()` in seconds, and `draw()`
    get duration() {
      return Math.max(0, ...[...this.shown].map((each) => each.duration()));
    },
    wake() {
      if (waiting) return;
      waiting = true;
      last = performance.now();
      requestAnimationFrame(tick);
    },
    play(playing) {
      clock.playing = playing;
      clock.wake();
    },
  };
  let waiting = false, last = 0;
  const tick = (now) => {
    const goesOn = clock.playing && clock.duration > 0;
    if (!clock.duration) clock.time = 0;
    if (goesOn) {
      clock.time += Math.max(0, now - last) / 1000;
      if (clock.time > clock.duration + HOLD) clock.time = 0;
    }
    last = now;
    clock.shown.forEach((each) => each.draw());
    waiting = goesOn;
    if (goesOn) requestAnimationFrame(tick);
  };
  window.addEventListener("keydown", (event) => {
    if (event.key === " " && !event.target.closest("a, button, input, textarea, select, [role=tab], [role=dialog]")) {
      clock.play(!clock.playing);
      event.preventDefault();
    }
  });
  return clock;
}

function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function trace(pen, shape, place, scale) {
  pen.beginPath();
  if (shape.kind === "disk") {
    pen.arc(...place(shape.centre), shape.radius * scale, 0, 2 * Math.PI);
  } else {
    const points = shape.kind === "capsule" ? [shape.start, shape.end] : shape.points;
    points.forEach((point) => pen.lineTo(...place(point)));
  }
}

function draw(pen, shape, place, scale) {
  const colour = COLOURS[shape.part];
  pen.fillStyle = pen.strokeStyle = colour;
  pen.lineCap = pen.lineJoin = "round";
  if (shape.kind === "label") {
    pen.fillText(shape.text, ...place(shape.centre));
    return;
  }
  trace(pen, shape, place, scale);
  if (shape.kind === "polygon" || shape.kind === "disk") {
    pen.fill();
  } else if (shape.kind === "polyline") {
    pen.lineWidth = 1.5;
    pen.stroke();
  } else {
    // A capsule has a white edge, to set it off from what is below.
    for (const [reach, stroke] of [[2.4, "white"], [0, colour]]) {
      pen.lineWidth = 2 * shape.radius * scale + reach;
      pen.strokeStyle = stroke;
      pen.stroke();
    }
  }
}

export default {
  template: `
    <div v-if="controls" class="player-controls">
      <button type="button" :aria-label="playing ? 'Pause' : 'Play'" @click="toggle">{{ playing ? "❚❚" : "▶" }}</button>
      <input type="range" min="0" :max="length" step="0.1" ref="slider" aria-label="Time of the playback"
             @input="seek($event.target.value)">
      <span ref="time"></span>
    </div>
    <div v-else class="player">
      <canvas ref="canvas" role="img" :aria-label="label"></canvas>
      <div class="player-message" v-if="message">{{ message }}</div>
      <dl class="totals" v-if="!message">
        <template v-for="(name, index) in objectives" :key="index"><dt>{{ name }}</dt><dd ref="totals">0</dd></template>
      </dl>
    </div>`,
  props: { src: String, objectives: Array, decimals: Array, label: String, controls: Boolean },
  data: () => ({ message: "", playing: clock.playing, length: 0 }),
  mounted() {
    this.shown = { duration: () => this.duration(), draw: () => this.draw() };
    clock.shown.add(this.shown);
    clock.wake();
    if (this.controls) return;
    this.observer = new ResizeObserver(clock.wake);
    this.observer.observe(this.$refs.canvas);
    this.message = "Recording an episode …";
    this.load();
  },
  watch: {
    src() { this.load(); }, // the episode that is shown goes on until the new one is here
  },
  beforeUnmount() {
    clock.shown.delete(this.shown);
    this.observer?.disconnect();
    clock.wake();
  },
  methods: {
    async load() {
      const src = this.src;
      if (!src) return;
      try {
        const response = await fetch(window.path_prefix + src);
        if (!response.ok) throw new Error((await response.json().catch(() => ({}))).detail ?? "the server failed");
        const episode = Object.freeze(await response.json());
        if (src !== this.src) return; // another one is wanted by now
        this.episode = episode;
        this.drawn = null;
        this.message = "";
        clock.wake();
      } catch (error) {
        if (src === this.src) this.message = `No playback: ${error.message}`;
      }
    },
    toggle() {
      clock.play(!clock.playing);
    },
    seek(time) {
      clock.time = Number(time);
      clock.play(false);
    },
    duration() {
      return this.episode ? (this.episode.frames.length - 1) * this.episode.seconds : 0;
    },
    draw() {
      if (this.controls) {
        this.playing = clock.playing;
        this.length = clock.duration;
        this.$refs.slider.max = clock.duration;
        const time = Math.min(clock.time, clock.duration).toFixed(1); // in tenths: no repainting in between
        if (Number(this.$refs.slider.value) !== Number(time)) this.$refs.slider.value = time;
        write(this.$refs.time, `${time} of ${clock.duration.toFixed(1)} s`);
      } else if (this.episode && this.$refs.canvas) {
        const { frames, seconds } = this.episode;
        const frame = frames[Math.min(Math.floor(clock.time / seconds), frames.length - 1)];
        this.drawFrame(frame);
        this.$refs.totals?.forEach((cell, index) => {
          write(cell, frame.totals[index].toFixed(this.decimals[index]).replace("-", "−"));
        });
      }
    },
    drawFrame(frame) {
      const canvas = this.$refs.canvas;
      const density = window.devicePixelRatio || 1;
      const width = canvas.clientWidth, height = canvas.clientHeight;
      if (canvas.width !== Math.round(width * density) || canvas.height !== Math.round(height * density)) {
        canvas.width = Math.round(width * density);
        canvas.height = Math.round(height * density);
        this.drawn = null;
      }
      if (this.drawn === frame) return;
      this.drawn = frame;
      const [left, right] = frame.window.x, [bottom, top] = frame.window.z;
      const scale = Math.min(width / (right - left), height / (top - bottom));
      const x0 = (width - scale * (right - left)) / 2;
      const place = ([x, z]) => [x0 + scale * (x - left), height - scale * (z - bottom)];
      const pen = canvas.getContext("2d");
      pen.setTransform(density, 0, 0, density, 0, 0);
      pen.clearRect(0, 0, width, height);
      pen.font = "10px sans-serif";
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      for (const shape of [...this.episode.still, ...frame.shapes]) draw(pen, shape, place, scale);
    },
  },
};
