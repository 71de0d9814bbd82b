// SPDX-License-Identifier: MIT
// Ready bits: two levels of hints that say which links have messages, and links that the owner
// polls instead; with weak memory.
//
//   peer    message ─ polled without fences? ─ fence ─ unwatched? ─ bit of the link ─ bit of its word
//   owner   clear bit of the word ─ read bits ─ clear bit of the link
//           ─ more left? set bit of the word ─ poll or revisit link
//
//   MODELS  shm/link.h: afterPush watch
//   MODELS  shm/link.cpp: afterFencedPush letPeerSendUnfenced unwatch execute
//   MODELS  shm/window.cpp: notify
//   MODELS  shm/ready_bits.cpp: set tryTakeFrom
//   MODELS  shm/hot_links.cpp: tryAdd cool
//   MODELS  shm/endpoint.cpp: nextReady hasEvents isRevisitDue
//   HOLDS   for each link with a message, a hint is set, the link is polled, or it is due for a
//           revisit; this does not need the scan of all links that an owner makes before it sleeps
//   HOLDS   no link is forgotten, for every order in which links begin and cease to be polled
//   ASSUMES two links of one word, two messages each; one link at a time may be polled
//   ASSUMES no process overwrites the hints; the scan of all links repairs that
//           (tests/shm/endpoint_hints_test.cpp)
//   BREAK   NO_WATCH_FENCE   the peer reads "unwatched" before its message is visible
//   BREAK   NO_SECOND_LOOK   the peer uses what it read before its fence
//   BREAK   NO_BARRIER       the owner executes its own fence alone after it let peers omit theirs
//   BREAK   BARRIER_EARLY    the owner executes the barrier before it stores "unwatched"
//   BREAK   NO_COOL_FENCE    the owner looks for messages before its "not polled" is visible
//   BREAK   NO_COOL_LOOK     the owner does not look when it stops polling
//   BREAK   WORD_FIRST       the peer sets the bit of the word before the bit of the link
//   BREAK   WORD_OFF_LATE    the owner clears the bit of the word after it has read the bits
//   BREAK   LEFT_FORGOTTEN   the owner does not set the bit of the word again for further bits
//   BREAK   NO_REVISIT       a link that is not added to the polled links is looked at once only
#define LINKS 2
#define OWNER 2
#define PROCESSES 3
#define SENT(link) (link)
#define WATCH(link) (LINKS + (link))
#define WORDS 4
#define FLUSH_ALL FLUSH(0, SENT(0)) FLUSH(1, SENT(1)) FLUSH(OWNER, WATCH(0)) FLUSH(OWNER, WATCH(1))
#include "memory.pml"

#define MESSAGES 2
#define NONE 2
// The values of a watch word; their numbers differ from those of the layout.
#define UNWATCHED 0
#define POLLED 1
#define UNFENCED 2

byte bits;  // bit i: link i may have a message
bool word;  // bits is not 0

// Locked instructions with release semantics: all earlier stores are visible.
inline setBits(process, link) {
#ifdef WORD_FIRST
  isVisible(process);
  word = true;
  bits = bits | BIT(link)
#else
  isVisible(process);
  bits = bits | BIT(link);
  word = true
#endif
}

proctype Peer(byte me) {
  byte sent, watch;
  do
  :: sent < MESSAGES ->
    sent++;
    storeRelease(me, SENT(me), sent);
    watch = memory[WATCH(me)];
    if
    :: watch == UNFENCED
    :: watch != UNFENCED ->
#ifndef NO_WATCH_FENCE
      fence(me);
#endif
#ifndef NO_SECOND_LOOK
      watch = memory[WATCH(me)];
#endif
      if
      :: watch == UNWATCHED -> setBits(me, me)
      :: else
      fi
    fi;
    watch = UNWATCHED
  :: sent == MESSAGES -> break
  od;
}

byte taken[LINKS];
byte hot = NONE;      // the link that is polled
bool isUnfenced;      // the peer of that link may omit its fence
byte revisit = NONE;

#define hasMessage(link) (memory[SENT(link)] != taken[link])
#define isHotReady ((hot == 0 && hasMessage(0)) || (hot == 1 && hasMessage(1)))
#define isRevisitDue ((revisit == 0 && hasMessage(0)) || (revisit == 1 && hasMessage(1)))
#define allTaken (taken[0] == MESSAGES && taken[1] == MESSAGES)

inline takeOne(link) {
  if
  :: atomic { hasMessage(link) -> taken[link]++ }
  :: !hasMessage(link)
  fi
}

// membarrier(): each peer executes a fence between the call and its return.
inline barrier() {
  fence(OWNER);
#ifndef NO_BARRIER
  fence(0);
  fence(1);
#endif
}

inline cool() {
  was = hot;
  hot = NONE;
#ifdef BARRIER_EARLY
  barrier();
#endif
  store(OWNER, WATCH(was), UNWATCHED);
#ifndef NO_COOL_FENCE
  if
#ifndef BARRIER_EARLY
  :: isUnfenced -> barrier()
#endif
  :: else -> fence(OWNER)
  fi;
#endif
  isUnfenced = false;
#ifndef NO_COOL_LOOK
  if
  :: hasMessage(was) -> setBits(OWNER, was)
  :: !hasMessage(was)
  fi;
#endif
  was = NONE
}

// Polls the link from now on in place of another one, or does not poll it.
inline tryAdd(link) {
  if
  :: hot == link
  :: hot != link && hot != NONE -> cool(); hot = link; store(OWNER, WATCH(link), POLLED)
#ifndef NO_REVISIT
  :: hot != link && hot != NONE -> revisit = link
#else
  :: hot != link && hot != NONE
#endif
  :: hot == NONE -> hot = link; store(OWNER, WATCH(link), POLLED)
  fi
}

inline tryTakeFrom() {
#ifdef WORD_OFF_LATE
  seen = bits;
  word = false;
#else
  word = false;
  seen = bits;
#endif
  if
  :: seen == 0
  :: seen != 0 ->
    if
    :: (seen & BIT(0)) != 0 -> link = 0
    :: (seen & BIT(1)) != 0 -> link = 1
    fi;
    d_step { seen = bits & ~BIT(link); bits = seen };
#ifndef LEFT_FORGOTTEN
    if
    :: seen != 0 -> word = true
    :: seen == 0
    fi;
#endif
    tryAdd(link);
    takeOne(link)
  fi;
  d_step { seen = 0; link = NONE }
}

active proctype Owner() {
  byte seen, link = NONE, was = NONE;
  do
  :: isHotReady -> takeOne(hot)
  :: hot != NONE && !allTaken -> cool()  // too many polls without a message
  :: hot != NONE && !isUnfenced && !allTaken -> isUnfenced = true; store(OWNER, WATCH(hot), UNFENCED)
  :: isRevisitDue || word ->
    if
    :: isRevisitDue -> setBits(OWNER, revisit)
    :: !isRevisitDue
    fi;
    revisit = NONE;
    if
    :: word -> tryTakeFrom()
    :: !word
    fi
  :: allTaken -> break
  od
}

init {
  atomic {
    run Peer(0);
    run Peer(1)
  }
}
