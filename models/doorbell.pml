// SPDX-License-Identifier: MIT
// Doorbell: an owner that announces its sleep, two peers that send and wake, a watcher that tells of deaths; over weak memory.
//
//   owner  announce ─ fence ─ look again ─ sleep                peer  message ─ fence ─ announced? ─ bell, wake
//
//   MODELS  shm/endpoint.cpp: sleep announce hasNews interrupt takeLocalNews arm disarm
//   MODELS  shm/window.cpp: wakeIfAsleep ring
//   MODELS  shm/doorbell.cpp: sleep ring ringFifo drainFifo
//   HOLDS   no wake-up is lost: the owner never sleeps for ever while a message or the news of a death waits for it
//   HOLDS   so on the futex and on the descriptor, also when a peer is killed between its message and its ring
//   ASSUMES the kernel compares the bell and puts to sleep in one step; FUTEX_WAKE is a fence for who calls it
//   ASSUMES two messages of one peer and one of the other; an owner without deadline that polls no link
//   BREAK   NO_PEER_FENCE    the peer looks whether somebody sleeps before its message is visible
//   BREAK   NO_OWNER_FENCE   the owner looks again before its announcement is visible
//   BREAK   NO_LOOK          the owner does not look again
//   BREAK   BELL_READ_LATE   the owner reads the bell after its look
//   BREAK   BELL_UNCHANGED   a peer wakes without changing the bell
//   BREAK   BELL_RELAXED     the bell may change before the news for which it rings is visible
//   BREAK   DRAIN_LATE       the descriptor is drained after the look
//   BREAK   NO_DEATH_NEWS    nobody tells of a death
#define PEERS 2
#define OWNER 2
#define WATCHER 3
#define PROCESSES 4
#define SENT(peer) (peer)
#define SLEEPING 2
#define LOCAL_NEWS 3
#define WORDS 4
#define FLUSH_ALL FLUSH(0, SENT(0)) FLUSH(1, SENT(1)) FLUSH(OWNER, SLEEPING) FLUSH(WATCHER, LOCAL_NEWS)
#include "memory.pml"

#define MESSAGES(peer) (2 - (peer))
#define AWAKE 0
#define ON_FUTEX 1
#define ON_DESCRIPTOR 2

bool changed;   // the bell, since the owner read it
bool asleep;    // in the kernel, on the bell
bool readable;  // the FIFO
byte sent[PEERS];
bool senderEnded[PEERS];

byte taken[PEERS];
bool deathSeen;

#define hasMessage (memory[SENT(0)] != taken[0] || memory[SENT(1)] != taken[1])
#define hasLocalNews (memory[LOCAL_NEWS] == 1 && !deathSeen)
#define hasNews (hasMessage || hasLocalNews)
#define allTaken (taken[0] == memory[SENT(0)] && taken[1] == memory[SENT(1)])
#define allSeen (allTaken && senderEnded[0] && senderEnded[1] && isVisible(0) && isVisible(1) && deathSeen == (dead[0] || dead[1]))

// FUTEX_WAIT: the kernel's comparison.
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
  isVisible(process);  // FUTEX_WAKE
  asleep = false
}

proctype Peer(byte me) {
  byte state;
  {
    do
    :: sent[me] < MESSAGES(me) ->
      atomic { storeRelease(me, SENT(me), sent[me] + 1); sent[me]++ };
#ifndef NO_PEER_FENCE
      fence(me);
#endif
      state = memory[SLEEPING];
      if
      :: state == AWAKE
      :: state == ON_FUTEX -> ringBell(me)
      :: state == ON_DESCRIPTOR -> readable = true
      fi
    :: sent[me] == MESSAGES(me) -> break
    od
  } unless { dead[me] };
  senderEnded[me] = true
}

active proctype Owner() {
  do
  :: atomic { memory[SENT(0)] != taken[0] -> taken[0]++ }
  :: atomic { memory[SENT(1)] != taken[1] -> taken[1]++ }
  :: atomic { hasLocalNews -> deathSeen = true }
  :: !hasNews ->
#ifndef BELL_READ_LATE
    changed = false;
#endif
    store(OWNER, SLEEPING, ON_FUTEX);
#ifndef NO_OWNER_FENCE
    fence(OWNER);
#endif
    if
#ifndef NO_LOOK
    :: hasNews
    :: !hasNews ->
#else
    :: true ->
#endif
#ifdef BELL_READ_LATE
      changed = false;
#endif
      futexWait()
    fi;
    store(OWNER, SLEEPING, AWAKE)
  :: !hasNews ->
#ifndef DRAIN_LATE
    readable = false;
#endif
    store(OWNER, SLEEPING, ON_DESCRIPTOR);
#ifndef NO_OWNER_FENCE
    fence(OWNER);
#endif
    if
#ifndef NO_LOOK
    :: hasNews
    :: !hasNews ->
#else
    :: true ->
#endif
#ifdef DRAIN_LATE
      readable = false;
#endif
      readable || allSeen
    fi;
    store(OWNER, SLEEPING, AWAKE)
  :: allSeen -> break
  od
}

// The thread of the owner's process that waits for the pidfds of its peers.
active proctype Watcher() {
end:
  (isGone(0) || isGone(1));
#ifndef NO_DEATH_NEWS
  storeRelease(WATCHER, LOCAL_NEWS, 1);
  ringBell(WATCHER);
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
