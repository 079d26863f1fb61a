// The list of runs: a row for each, which opens its run where `opens` is true. Words in the field keep the rows that have all of them.
//
// A row is { name, state, cells: [[text, text below it], ...], written }, `written` in seconds since the epoch.
const MANY = 8; // runs, from which on there is a field for words
const UNITS = [["day", 86400], ["hour", 3600], ["minute", 60]];

export default {
  template: `
    <div class="runs">
      <label v-if="rows.length > ${MANY}" class="runs-filter">
        <input type="search" v-model="words" :placeholder="texts.filter" :aria-label="texts.filter">
      </label>
      <div class="runs-table" role="table" :aria-label="columns[0]" v-if="listed.length" @keydown="press">
        <div class="runs-row runs-head" role="row">
          <span v-for="column in columns" :key="column" role="columnheader">{{ column }}</span>
        </div>
        <div v-for="row in listed" :key="row.name" role="row" :class="['runs-row', row.state]">
          <span v-for="([text, below], index) in row.cells" :key="index" role="cell">
            <button v-if="index === 0 && opens" type="button" class="runs-open" @click="$emit('open', row.name)">{{ text }}</button>
            <b v-else-if="text">{{ text }}</b>
            <small v-if="below">{{ below }}</small>
          </span>
          <span role="cell"><time :title="date(row.written)">{{ ago(row.written) }}</time></span>
        </div>
      </div>
      <p v-else class="runs-none" role="status">{{ rows.length ? texts.none : empty }}</p>
    </div>`,
  props: { rows: Array, columns: Array, texts: Object, empty: String, opens: Boolean },
  data: () => ({ words: "", now: Date.now() / 1000 }),
  computed: {
    listed() {
      const words = this.words.toLowerCase().split(/\s+/).filter(Boolean);
      if (!words.length) return this.rows;
      return this.rows.filter((row) => {
        const text = row.cells.flat().join(" ").toLowerCase();
        return words.every((word) => text.includes(word));
      });
    },
  },
  mounted() {
    this.clock = setInterval(() => (this.now = Date.now() / 1000), 10000);
  },
  unmounted() {
    clearInterval(this.clock);
  },
  methods: {
    date: (written) => new Date(written * 1000).toLocaleString(),
    ago(written) {
      const seconds = Math.max(0, this.now - written);
      const [unit, size] = UNITS.find(([, size]) => seconds >= size) ?? ["second", Infinity];
      return new Intl.RelativeTimeFormat("en", { numeric: "auto" }).format(-Math.floor(seconds / size), unit);
    },
    press(event) {
      const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      const buttons = [...this.$el.querySelectorAll(".runs-open")];
      buttons[buttons.indexOf(document.activeElement) + step]?.focus();
    },
  },
};
