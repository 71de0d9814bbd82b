// SPDX-License-Identifier: MIT
// Bias: a lock that its owner enters without a locked instruction, and another thread that takes
// this right away; with weak memory.
//
//   owner   inside = 1 ─ still enabled? ─ ... ─ inside = 0
//   other   real lock ─ enabled = 0 ─ barrier in all threads ─ wait until inside = 0 ─ ...
//
//   MODELS  base/bias.h: tryEnter leave noteEntry disable isInside
//   MODELS  base/biased_lock.h: Guard lockReal
//   HOLDS   at most one thread is inside at a time, however often the bias is disabled and enabled
//           again
//   HOLDS   a thread that is inside sees what the other one did there
//   HOLDS   no thread waits forever
//   ASSUMES two threads, of which one may become the owner: Bias never has a second owner
//   ASSUMES the real lock orders what its holders do (tests/base/spin_lock_test.cpp)
//   BREAK   NO_SECOND_LOOK   the owner does not look again whether the bias is enabled
//   BREAK   NO_BARRIER       the other thread executes a fence of its own only
//   BREAK   BARRIER_EARLY    the other thread executes the barrier before it disables the bias
//   BREAK   NO_WAIT          the other thread does not wait for an owner that is inside
//   BREAK   LEAVE_RELAXED    the owner leaves before what it did is visible
#define OWNER 0
#define OTHER 1
#define PROCESSES 2
#define INSIDE 0
#define DISABLED 1     // how often the bias was disabled; it is enabled if `grants` is larger
#define DATA(thread) (2 + (thread))
#define WORDS 4
#define FLUSH_ALL FLUSH(OWNER, INSIDE) FLUSH(OWNER, DATA(OWNER)) FLUSH(OTHER, DISABLED) FLUSH(OTHER, DATA(OTHER))
#include "memory.pml"

#define ENTRIES 3

bool locked;   // the real lock
byte holders;
byte grants;   // how often the bias was enabled; changed under the real lock
byte done[PROCESSES];

#define isEnabled(thread) (grants > load(thread, DISABLED))

inline lockReal() { atomic { !locked -> locked = true } }
inline unlockReal(thread) { isVisible(thread); locked = false }

inline work(thread) {
  holders++;
  assert(holders == 1);
  assert(memory[DATA(1 - thread)] == done[1 - thread]);
  d_step { done[thread]++; }
  store(thread, DATA(thread), done[thread]);
  holders--
}

inline leave() {
#ifdef LEAVE_RELAXED
  store(OWNER, INSIDE, 0)
#else
  storeRelease(OWNER, INSIDE, 0)
#endif
}

active proctype Owner() {
  byte entries;
  bool isInside;
  do
  :: entries == ENTRIES -> break
  :: entries < ENTRIES ->
    if
    :: isEnabled(OWNER) ->
      store(OWNER, INSIDE, 1);
#ifndef NO_SECOND_LOOK
      if
      :: isEnabled(OWNER) -> isInside = true
      :: else -> leave()
      fi
#else
      isInside = true
#endif
    :: else
    fi;
    if
    :: isInside -> work(OWNER); leave()
    :: else ->
      lockReal();
      work(OWNER);
      if
      :: !isEnabled(OWNER) -> grants++
      :: true
      fi;
      unlockReal(OWNER)
    fi;
    isInside = false;
    entries++
  od
}

inline barrier() {
  fence(OTHER);
#ifndef NO_BARRIER
  fence(OWNER)
#endif
}

active proctype Other() {
  byte entries;
  do
  :: entries == ENTRIES -> break
  :: entries < ENTRIES ->
    lockReal();
    if
    :: isEnabled(OTHER) ->
#ifdef BARRIER_EARLY
      barrier();
#endif
      storeRelease(OTHER, DISABLED, grants);
#ifndef BARRIER_EARLY
      barrier();
#endif
    :: else
    fi;
#ifndef NO_WAIT
    memory[INSIDE] == 0;
#endif
    work(OTHER);
    unlockReal(OTHER);
    entries++
  od
}
