// Calls somebody who is elsewhere when a question opens: by a soft sound, and by a notification where they allow it.
//
// The browser remembers the switch, and the tab which question it has seen: a page that is loaded anew calls for no
// question twice. Between two questions nothing runs.
const SWITCH = "jmorl-call", SEEN = "jmorl-question";
const TONES = [[523.25, 0], [783.99, 0.18]]; // hertz, and seconds after the call
const LOUDNESS = 0.12, SECONDS = 0.7;

export default {
  template: `
    <q-btn class="call" color="primary" flat dense no-caps no-wrap size="sm" :icon="on ? 'notifications_active' : 'notifications_off'" :label="label"
           :aria-pressed="on" :aria-label="hint" :title="hint" @click="turn" />`,
  props: { question: String, text: String, label: String, hint: String },
  data: () => ({ on: localStorage.getItem(SWITCH) !== null }),
  watch: {
    question() { this.see(); },
  },
  mounted() {
    this.follow = () => (this.on = localStorage.getItem(SWITCH) !== null);
    window.addEventListener("storage", this.follow); // another tab has turned the switch
    this.see();
  },
  unmounted() {
    window.removeEventListener("storage", this.follow);
  },
  methods: {
    see() {
      if (!this.question || this.question === sessionStorage.getItem(SEEN)) return;
      sessionStorage.setItem(SEEN, this.question);
      if (this.on && (document.hidden || !document.hasFocus())) {
        this.sound();
        this.notify();
      }
    },
    async turn() {
      this.on = !this.on;
      if (!this.on) {
        localStorage.removeItem(SWITCH);
        return;
      }
      localStorage.setItem(SWITCH, "on");
      this.sound();
      if (window.Notification?.permission === "default") await Notification.requestPermission();
    },
    sound() {
      // Before the first click on a page the browser holds sounds back, and would let this one be heard too late.
      if (navigator.userActivation?.hasBeenActive === false) return;
      const audio = new AudioContext();
      let tone;
      for (const [frequency, later] of TONES) {
        const begin = audio.currentTime + later;
        const volume = new GainNode(audio, { gain: 0 });
        volume.gain.setValueAtTime(0, begin);
        volume.gain.linearRampToValueAtTime(LOUDNESS, begin + 0.03);
        volume.gain.exponentialRampToValueAtTime(0.001, begin + SECONDS);
        tone = new OscillatorNode(audio, { frequency });
        tone.connect(volume).connect(audio.destination);
        tone.start(begin);
        tone.stop(begin + SECONDS);
      }
      tone.onended = () => audio.close();
    },
    notify() {
      if (window.Notification?.permission !== "granted") return;
      try {
        const notification = new Notification(this.text, { tag: SWITCH });
        notification.onclick = () => {
          window.focus();
          notification.close();
        };
      } catch {} // browsers on phones leave it at the sound
    },
  },
};
