// SPDX-License-Identifier: MIT
// Doorbell: an owner that announces its sleep, two peers that send and wake, a watcher that reports
// deaths; with weak memory.
//
//   owner  announce ─ fence ─ look again ─ sleep
//   peer   message ─ fence ─ announced? ─ bell, wake
//
//   MODELS  shm/endpoint.cpp: sleep announce hasEvents interrupt arm disarm
//   MODELS  shm/endpoint.h: takeLocalEvent
//   MODELS  shm/window.cpp: wakeIfAsleep ring
//   MODELS  shm/doorbell.cpp: sleep ring tryRingFifo drainFifo
//   HOLDS   no wake-up is lost: the owner does not sleep forever while a message or a reported
//           death is pending
//   HOLDS   this is true on the futex and on the descriptor, and also if a peer is killed between
//           message and ring
//   ASSUMES FUTEX_WAIT compares the bell and sleeps in one step; FUTEX_WAKE is a fence for its
//           caller
//   ASSUMES two messages of one peer and one of the other; an owner without a deadline that polls
//           no link
//   BREAK   NO_PEER_FENCE    the peer reads the announcement before its message is visible
//   BREAK   NO_OWNER_FENCE   the owner looks again before its announcement is visible
//   BREAK   NO_LOOK          the owner does not look again
//   BREAK   BELL_READ_LATE   the owner reads the bell after its last look
//   BREAK   BELL_UNCHANGED   a peer wakes without changing the bell
//   BREAK   BELL_RELAXED     the bell may change before the event that it reports is visible
//   BREAK   DRAIN_LATE       the descriptor is drained after the last look
//   BREAK   NO_DEATH_NEWS    no process reports a death
//   BREAK   NUMBER_KEPT      a sleep has the number of the previous one, for which a peer has rung
//   BREAK   NUMBER_LATE      the number of a sleep is stored after the last look
//   BREAK   STATE_EARLY      a peer reads how the owner sleeps before the number: wrong bell
#define PEERS 2
#define OWNER 2
#define WATCHER 3
#define PROCESSES 4
#define SENT(peer) (peer)
#define SLEEPING 2
#define LOCAL_EVENT 3
#define NUMBER 4
#define WORDS 5
#define FLUSH_ALL FLUSH(0, SENT(0)) FLUSH(1, SENT(1)) FLUSH(OWNER, SLEEPING) FLUSH(OWNER, NUMBER) FLUSH(WATCHER, LOCAL_EVENT)
#include "memory.pml"

#define MESSAGES(peer) (2 - (peer))
#define AWAKE 0
#define ON_FUTEX 1
#define ON_DESCRIPTOR 2

bool changed;   // the bell has changed since the owner read it
bool asleep;    // the owner sleeps in the kernel on the bell
bool readable;  // the FIFO is readable
byte sent[PEERS];
bool senderEnded[PEERS];

byte taken[PEERS];
bool deathSeen;
byte sleeps;          // the number of the owner's sleep
byte number;          // the number that peer 0 has read
byte rungFor;         // the number for which peer 0 has rung

#define hasMessage (memory[SENT(0)] != taken[0] || memory[SENT(1)] != taken[1])
#define hasLocalEvent (memory[LOCAL_EVENT] == 1 && !deathSeen)
#define hasEvents (hasMessage || hasLocalEvent)
#define hasEnded(peer) (senderEnded[peer] || dead[peer])
#define allTaken (taken[0] == memory[SENT(0)] && taken[1] == memory[SENT(1)])
#define allSeen (allTaken && hasEnded(0) && hasEnded(1) && isVisible(0) && isVisible(1) && deathSeen == (dead[0] || dead[1]))

// The comparison that FUTEX_WAIT makes.
inline futexWait() {
  if
  :: atomic { !changed -> asleep = true }; !asleep || allSeen
  :: changed
  fi
}

inline ringBell(process) {
#ifndef BELL_UNCHANGED
#ifndef BELL_RELAXED
  isVisible(process);
#endif
  changed = true;
#endif
  isVisible(process)  // FUTEX_WAKE; the caller ends the sleep of the owner
}

// Only peer 0 sends two messages, so only it may have rung before. What a peer has read for a
// message is not used after it.
inline readNumber(peer) {
  d_step { if :: peer == 0 -> number = memory[NUMBER] :: else fi }
}
inline noteRung(peer) {
  if :: peer == 0 -> rungFor = number :: else fi
}
inline endMessage(peer) {
  state = AWAKE;
  senderEnded[peer] = (sent[peer] == MESSAGES(peer));
  if
  :: peer == 0 -> number = 0; rungFor = (senderEnded[peer] -> 0 : rungFor)
  :: else
  fi
}
#define hasRung (me == 0 && number != 0 && number == rungFor)

proctype Peer(byte me) {
  byte state;
  {
    do
    :: !senderEnded[me] ->
      atomic { storeRelease(me, SENT(me), sent[me] + 1); sent[me]++ };
#ifndef NO_PEER_FENCE
      fence(me);
#endif
#ifndef STATE_EARLY
      readNumber(me);
#endif
      atomic {
        state = memory[SLEEPING];
#ifdef STATE_EARLY
      }
      atomic {
        readNumber(me);
#endif
        if
        :: state == AWAKE || hasRung -> endMessage(me)
        :: else
        fi
      };
      if
      :: state == AWAKE
      :: state == ON_FUTEX -> ringBell(me); d_step { asleep = false; noteRung(me); endMessage(me) }
      :: state == ON_DESCRIPTOR -> d_step { readable = true; noteRung(me); endMessage(me) }
      fi
    :: senderEnded[me] -> break
    od
  } unless { dead[me] }
}

inline newNumber() {
#ifdef NUMBER_KEPT
  sleeps = 1
#else
  // Numbers matter only where a peer compares them, so a number that no peer has read need not
  // change.
  if
  :: sleeps == 0 || sleeps == number || sleeps == rungFor -> sleeps++
  :: else
  fi
#endif
}

active proctype Owner() {
  do
  :: atomic { memory[SENT(0)] != taken[0] -> taken[0]++ }
  :: atomic { memory[SENT(1)] != taken[1] -> taken[1]++ }
  :: atomic { hasLocalEvent -> deathSeen = true }
  :: !hasEvents ->
#ifndef BELL_READ_LATE
    changed = false;
#endif
    store(OWNER, SLEEPING, ON_FUTEX);
#ifndef NUMBER_LATE
    atomic { newNumber(); storeRelease(OWNER, NUMBER, sleeps) }
#else
    newNumber();
#endif
#ifndef NO_OWNER_FENCE
    fence(OWNER);
#endif
    if
#ifndef NO_LOOK
    :: hasEvents
    :: !hasEvents ->
#else
    :: true ->
#endif
#ifdef BELL_READ_LATE
      changed = false;
#endif
#ifdef NUMBER_LATE
      store(OWNER, NUMBER, sleeps);
#endif
      futexWait()
    fi;
    store(OWNER, SLEEPING, AWAKE)
  :: !hasEvents ->
#ifndef DRAIN_LATE
    readable = false;
#endif
    store(OWNER, SLEEPING, ON_DESCRIPTOR);
#ifndef NUMBER_LATE
    atomic { newNumber(); storeRelease(OWNER, NUMBER, sleeps) }
#else
    newNumber();
#endif
#ifndef NO_OWNER_FENCE
    fence(OWNER);
#endif
    if
#ifndef NO_LOOK
    :: hasEvents
    :: !hasEvents ->
#else
    :: true ->
#endif
#ifdef DRAIN_LATE
      readable = false;
#endif
#ifdef NUMBER_LATE
      store(OWNER, NUMBER, sleeps);
#endif
      readable || allSeen
    fi;
    store(OWNER, SLEEPING, AWAKE)
  :: allSeen -> break
  od
}

// The watcher: the thread of the owner's process that waits for the pidfds of its peers.
active proctype Watcher() {
end:
  (isGone(0) || isGone(1));
#ifndef NO_DEATH_NEWS
  storeRelease(WATCHER, LOCAL_EVENT, 1);
  ringBell(WATCHER);
  asleep = false;
  readable = true
#endif
}

active proctype Killer() {
  if
  :: dead[0] = true
  :: skip
  fi
}

init {
  atomic {
    run Peer(0);
    run Peer(1)
  }
}
