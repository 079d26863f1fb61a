"""The words of both pages that never change: titles, labels, buttons, hints."""

from jmorl.storage.notes_file import LONGEST_NAME, LONGEST_TEXT

# Titles of panels:
POLICIES, PROGRESS, HISTORY, NAVIGATION, BETWEEN = "Policies", "Progress", "History", "E-NAUTILUS", "Between"
LIMITS = "Limits"
LIMITS_LATER = "What does not reach this is left out of the table and grey in the chart."
LIMITS_HINT = (
    "Say what each objective must reach. What does not is left out of the table and grey in the chart; with your next "
    "answer the search keeps to it, too."
)
NO_NUMBER = "a number, please"
WARM_UP = "The first policies learn the basics. You soon see how they do."
EARLY = "The first policies, still learning. You are asked when the warm-up is over."
WATCHED = (
    "This page is for watching. Policies are trained that trade {objectives} against each other. After a round of "
    "training a person says which one they like best; the next round searches around it. “You” on this page is that "
    "person. Look at policies, play and compare them as you like: it changes nothing for anybody else."
)
WATCHING, ONLY_WATCHING = "Only watching", "Nothing has changed: this page is for watching."
WATCHING_HINT = "“You” on this page is the person who steers."
OTHERS_ANSWER = "Somebody else answers."
NO_DIALOGUE = "Nobody is going through E-NAUTILUS just now. When somebody does, it is shown here."
SHARE, SHARE_TITLE, SHARE_LINK = "Share", "Let others watch", "Address for watching"
SHARE_RIGHTS = (
    "Whoever has this address sees the run that is open, its history, and the list of runs. They can look at policies, "
    "play and compare them, and save files.",
    "They cannot answer, end or pause a run, open or begin one, go back in the history, or change names and notes.",
)
SHARE_GUARDED = "It leads nowhere else: steering takes another token."
SHARE_OPEN = (
    "But mind: the studio is served on this machine alone, where steering takes no token. Whoever reaches it, here or "
    "through a tunnel, can leave out /watch and steer. If they must not, start it with a --token."
)
COPY, COPIED, COPY_YOURSELF = "Copy", "The address is copied.", "It could not be copied; mark the address, and copy it."
CALL, CALL_HINT = "Call me", "Call me when it is my turn"
KEEP_HINT = "What you chose last, or what is now better than that in everything."
SKIP, SKIP_HINT = (
    "Skip",
    "You cannot say: the search goes on by your earlier answers, and learns nothing from this one.",
)
COMPARE_TWO = "Compare two"
COMPARE_TWO_HINT = (
    "You are asked about two policies instead, those whose comparison tells most. Training then goes on from the "
    "policy that all your answers so far speak for."
)
ASK_NOW_HINT = "The next question comes when this round is over."
TAKE_BACK_HINT = "You are asked the question that was answered for you, in a new branch."
MORE_FILES = {
    "The front as a table (CSV)": "/fronts/{run}.csv",
    "The front as a picture (PNG)": "/pictures/{run}.png",
    "The journey as a page (HTML)": "/journeys/{run}.html",
}
KEPT = "What the run had is kept."
PUT_RIGHT = "Go on when that is put right."
GOING_ON_FAILS = "Going on would fail in the same way: step back in the history, and choose otherwise."
HOW_TO = "The policy file is saved. Put it beside your program, where jmorl is installed, and use it so:"
PAUSE_HINT = "The run stops when this round is over, and can go on from there at any time."
TRAIN_ON_HINT = "A new branch goes on where this run ended. This run and its result stay as they are."
END_TITLE = "End the run?"
END_EXPLANATION = "The policy becomes the result. You can step back in the history or train on at any time."
END_LATER = "The run ends when this round is over."
LOST = (
    "The studio does not answer: nothing that you press counts now. What the run has is kept. This page goes on by "
    "itself as soon as the studio is there again. If it was ended, start it again: {command}"
)
NONE_REACHES = "None of them reaches your limits."
LAST_ROUND = "This is the last round: after it you choose the result."
BETWEEN_HINT = "Lay out two policies. A dial then leads from one to the other: see what lies between them, and beyond."
SCORING = "Scoring …"
PROGRESS_HINT = (
    "The hypervolume measures all that the front is better than: it grows whenever a policy is found that is better "
    "than what there was."
)
REPLACED = "No longer in the front: a later policy is better in everything"
NAME, NOTE = "Name", "Note"
NOTES_PROBLEM = "Names and notes cannot be shown: {problem}"
NOTE_HINT = f"A name has {LONGEST_NAME} characters at most, a note {LONGEST_TEXT:,}. They are kept with the run."
COMPARE, COMPARED = "Compare branches", "Branches compared"
COMPARE_HINT = "Stars are results. Policies that branches share lie over each other."
NOTHING_TO_COMPARE = "There is nothing to compare yet: two branches with a front are needed."
KEYS = (
    ("← →", "look at the next policy along the front"),
    ("↑ ↓", "in the table: look at the next row"),
    ("1 2 …", "what is better in objective 1, 2, …; once more: all policies"),
    ("=", "of two policies that are asked about, like one as much as the other"),
    ("c", "choose the policy in focus"),
    ("f", "make the policy in focus a favourite, or one no longer"),
    ("k", "keep the last choice"),
    ("x", "put the policy in focus away"),
    ("space", "stop and start the playback"),
    ("?", "these keys"),
)
# Buttons, and labels beside fields:
LOOK_HINT = "Click a policy in a chart or in the table to see what it does."
CLOSE = "Close"
NOT_YET = "Not yet"
OPEN = "Open"
CHOOSE_OTHERWISE = "Choose otherwise"
GOT_IT = "Got it"
KEY_LIST = "Keys"
CHANGE = "Change"
STEP_BACK = "Step back"
PREFER = "Prefer"
LAID_OUT_BELOW = "It is laid out below, where you can choose it."
LOOK_AT_IT = "Look at it"
BEGIN_AGAIN = "Begin again"
SAVE = "Save"
CANCEL = "Cancel"
GO_ON = "Go on with this run"
BETTER_IN = "Better in"
NO_DIFFERENCE = "No difference"
THEN_GO_ON_FOR = "then go on for"
STOP_HERE = "Stop here"
ASK_NOW = "Ask me after this round"
PAUSE = "Pause training"
SAVE_POLICY = "Save the policy file"
SAVE_MORE = "Save more"
HOW_IT_CAME_ABOUT = "How it came about"
TRAIN_ON = "Train on for"
ROUNDS = "rounds"

# The home page:
ALL_RUNS, GO_TO_RUN = "All runs", "Go to it"
RUNS_COLUMNS = ("Run", "Environment", "Progress", "State", "Last written")
READING, NO_RUNS = "Reading the folder …", "There is no run in this folder yet. Begin one with the form."
FILTER, NO_MATCH = "Filter the runs", "No run has all these words."
GONE = "{name} is no longer there."
NEW_RUN, UNNAMED, BEGIN = "New run", "the new run", "Begin"
STATES = {
    "finished": "Finished",
    "interrupted": "Interrupted",
    "elsewhere": "Running elsewhere",
    "damaged": "Damaged",
}
OPEN_HERE = "Open here"
ENVIRONMENT, PRESET, STEPS, SEED = "Environment", "Preset", "Steps of training", "Seed"
FOLDER = "Folder (empty: date and time)"
MORE_SETTINGS, MORE_LABEL = "More settings", "Settings as TOML"
MORE_HINT = "A line for each, such as ppo.learning_rate = 1e-3. They count more than the fields above."
USUAL = "as usual: {value}"
ASK_LABEL = "You are asked"
ASK = {"always": "before every round", "unsure": "only when in doubt"}
QUESTION_LABEL = "You are asked for"
QUESTION = {
    "front": "the best of the whole front",
    "few": "the best of a few policies",
    "pair": "the better one of a pair",
    "rank": "an order of a few policies",
}
