// SPDX-License-Identifier: MIT
// Weak memory: other processes see the stores of a process later and in another order.
//
//   store ─► pending (only its writer sees it) ─ any time later ─► memory (all see it)
//
//   store         visible after any time, before or after stores to other words: weaker than x86,
//                 as on ARM
//   storeRelease  visible after all earlier stores of its process
//   fence         waits until all earlier stores of its process are visible
//   load          the newest value that this process can see
//
// A word has one writer; a store waits until the previous value of the word is visible. Loads
// happen in program order; where the source needs an acquire for that, its model has a variant that
// does the later load early. Locked instructions change plain variables of the model at once; those
// with release semantics first wait for isVisible(). A killed process stores nothing more, but its
// earlier stores become visible.
//
// The model defines WORDS (at most 16), PROCESSES and FLUSH_ALL, which is one FLUSH(process, word)
// for each word.
byte memory[WORDS];
byte pending[WORDS];       // the pending value, or 0
short before[WORDS];       // for a release store: words that must become visible first
short unseen[PROCESSES];   // words with a pending store
bool dead[PROCESSES];

#define BIT(word) (1 << (word))
#define isVisible(process) (unseen[process] == 0)
// The kernel reports a death after all stores of the process are visible.
#define isGone(process) (dead[process] && isVisible(process))
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
