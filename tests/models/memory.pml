// SPDX-License-Identifier: MIT
// Weak memory: what a process has stored, others see later, and in another order.
//
//   store ─► pending (only its writer sees it) ─ any time later ─► memory (all see it)
//
//   store         visible after any time, before or after stores to other words: weaker than x86, as on ARM
//   storeRelease  visible after all that its process stored before
//   fence         waits until all that its process stored is visible
//   load          the newest value that this process can see
//
// A word has one writer, and waits for its last value to be visible before it takes the next. Loads happen in program order; where that
// hangs on an acquire, the model of it has a variant that does the later load early. Locked instructions act on plain variables of the
// model at once; those that release wait for isVisible() first. Who is killed stores no more, but what was stored becomes visible.
//
// The model defines WORDS (at most 16), PROCESSES and FLUSH_ALL, one FLUSH(process, word) for each word.
byte memory[WORDS];
byte pending[WORDS];       // value, 0 when there is none
short before[WORDS];       // a release store: words that must become visible first
short unseen[PROCESSES];   // words that are pending
bool dead[PROCESSES];

#define BIT(word) (1 << (word))
#define isVisible(process) (unseen[process] == 0)
#define isGone(process) (dead[process] && isVisible(process))  // the kernel's word on a death comes after the stores of the dead
#define load(process, word) ((unseen[process] & BIT(word)) -> pending[word] : memory[word])

inline storeAfter(process, word, value, others) {
  d_step {
    (unseen[process] & BIT(word)) == 0;
    pending[word] = value;
    before[word] = others;
    unseen[process] = unseen[process] | BIT(word);
  }
}
inline store(process, word, value) { storeAfter(process, word, value, 0) }
inline storeRelease(process, word, value) { storeAfter(process, word, value, unseen[process]) }
inline fence(process) { isVisible(process) }

#define FLUSH(process, word) \
  :: d_step { \
    (unseen[process] & BIT(word)) != 0 && before[word] == 0; \
    memory[word] = pending[word]; \
    pending[word] = 0; \
    unseen[process] = unseen[process] & ~BIT(word); \
    other = 0; \
    do \
    :: other < WORDS -> before[other] = before[other] & ~BIT(word); other++ \
    :: else -> break \
    od; \
    other = 0 \
  }

active proctype Memory() {
  byte other;
end:
  do
  FLUSH_ALL
  od
}
