// A sortable table of policies that stays fast with thousands: only the rows in sight are in the document.
//
// Rows are [id, place, cell, cell, ...]: `place` is "outside" for one outside the bounds, and "replaced" for one that is
// no longer in the front, which is shown only where it is asked for by its id. Values are returns, sorted as such, the
// best first; a column's `scale` turns them into what people say.
const HEIGHT = 26; // pixels of a row, as in studio.css
const SPARE = 8; // rows above and below those in sight
const NARROWEST = 76; // pixels of a column; one of words has two
const EDGES = 58; // pixels of a row beside its columns, as in studio.css

export default {
  template: `
    <div class="policies" role="grid" aria-label="Policies" :aria-rowcount="order.length + 1" tabindex="0"
         @scroll.passive="top = $event.target.scrollTop" @keydown="press">
      <div class="policies-head" role="row" :style="{ minWidth }">
        <div v-for="(column, index) in columns" :key="index" role="columnheader" :class="{ words: column.words }"
             :aria-sort="by === index ? (down ? 'descending' : 'ascending') : 'none'">
          <button type="button" :title="column.hint" @click="sort(index)">
            {{ column.label }}<span aria-hidden="true">{{ by === index ? (down ? " ▾" : " ▴") : "" }}</span>
          </button>
        </div>
      </div>
      <div class="policies-body" :style="{ height: order.length * ${HEIGHT} + 'px', minWidth }">
        <div v-for="place in places" :key="rows[order[place]][0]" role="row" :aria-rowindex="place + 2"
             :aria-selected="rows[order[place]][0] === focus" :class="classes(rows[order[place]])"
             :style="{ top: place * ${HEIGHT} + 'px' }" @click="$emit('look', rows[order[place]][0])">
          <span role="gridcell"><b v-if="marks[rows[order[place]][0]]" :class="'mark-' + marks[rows[order[place]][0]]">{{
            marks[rows[order[place]][0]] }}</b><i v-if="favourites.includes(rows[order[place]][0])" role="img"
            aria-label="favourite">★</i></span>
          <span v-for="(column, index) in columns" :key="index" role="gridcell" :class="{ words: column.words }"
                :title="column.words && text(rows[order[place]], index)">{{ text(rows[order[place]], index) }}</span>
        </div>
      </div>
    </div>`,
  props: { rows: Array, columns: Array, favourites: Array },
  data: () => ({ by: 1, down: true, top: 0, height: 300, marks: {}, focus: null, kept: null }),
  computed: {
    order() {
      const kept = this.kept && new Set(this.kept);
      const shown = ([id, place]) => (kept ? kept.has(id) : place !== "replaced");
      const order = [...this.rows.keys()].filter((index) => shown(this.rows[index]));
      const key = (index) => this.value(this.rows[index], this.by);
      const compare = (a, b) => (typeof a === "string" ? a.localeCompare(b) : a - b);
      return order.sort((a, b) => (this.down ? -1 : 1) * compare(key(a), key(b)) || a - b);
    },
    minWidth() {
      return this.columns.reduce((width, { words }) => width + (words ? 2 : 1) * NARROWEST, EDGES) + "px";
    },
    places() {
      const first = Math.max(0, Math.floor(this.top / HEIGHT) - SPARE);
      const last = Math.min(this.order.length, Math.ceil((this.top + this.height) / HEIGHT) + SPARE);
      return Array.from({ length: Math.max(0, last - first) }, (_, index) => first + index);
    },
  },
  mounted() {
    this.observer = new ResizeObserver(() => (this.height = this.$el.clientHeight));
    this.observer.observe(this.$el);
  },
  unmounted() {
    this.observer.disconnect();
  },
  methods: {
    value: (row, column) => (column ? row[column + 1] : row[0]),
    text(row, index) {
      const { decimals, std, scale } = this.columns[index];
      if (decimals === undefined) return String(this.value(row, index));
      const write = (value) => (Number((value * scale).toFixed(decimals)) + 0).toFixed(decimals).replace("-", "−");
      return `${write(this.value(row, index))} ±${write(Math.abs(row[std]) * Math.sign(scale))}`;
    },
    classes(row) {
      return ["policies-row", row[1], { focus: row[0] === this.focus }];
    },
    sort(index) {
      this.down = this.by === index ? !this.down : true;
      this.by = index;
    },
    // What the page calls: which policies are laid out under which letter, which is in focus, which are shown.
    lay_out(marks, focus, kept, by) {
      this.marks = marks;
      this.kept = kept;
      if (by !== null) [this.by, this.down] = [by, true];
      if (focus !== this.focus) {
        this.focus = focus;
        this.reveal(this.order.findIndex((index) => this.rows[index][0] === focus));
      }
    },
    reveal(place) {
      if (place < 0) return;
      const top = place * HEIGHT, seen = this.height - 2 * HEIGHT;
      if (top < this.$el.scrollTop || top > this.$el.scrollTop + seen) this.$el.scrollTop = Math.max(0, top - seen / 2);
    },
    press(event) {
      const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity }[event.key];
      if (step === undefined || !this.order.length) return;
      event.preventDefault();
      const place = this.order.findIndex((index) => this.rows[index][0] === this.focus);
      const next = place < 0 ? 0 : Math.min(Math.max(place + step, 0), this.order.length - 1);
      this.reveal(next);
      this.$emit("look", this.rows[this.order[next]][0]);
    },
  },
};
