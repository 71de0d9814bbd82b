// SPDX-License-Identifier: MIT
// Ready bits: two levels of hints that say which links have messages, and links that the owner
// polls instead; with weak memory.
//
//   peer    message ─ fence ─ unwatched? ─ bit of the link ─ bit of its word
//   owner   clear bit of the word ─ read bits ─ clear bit of the link
//           ─ more left? set bit of the word ─ poll or revisit link
//
//   MODELS  shm/link.cpp: afterPush setWatched
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
//   BREAK   NO_WATCH_FENCE   the peer reads `unwatched` before its message is visible
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
#define POLLED(link) (LINKS + (link))  // the opposite of the word `unwatched` of the layout
#define WORDS 4
#define FLUSH_ALL FLUSH(0, SENT(0)) FLUSH(1, SENT(1)) FLUSH(OWNER, POLLED(0)) FLUSH(OWNER, POLLED(1))
#include "memory.pml"

#define MESSAGES 2
#define NONE 2

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
  byte sent;
  bool polled;
  do
  :: sent < MESSAGES ->
    sent++;
    storeRelease(me, SENT(me), sent);
#ifndef NO_WATCH_FENCE
    fence(me);
#endif
    polled = memory[POLLED(me)];
    if
    :: polled
    :: !polled -> setBits(me, me)
    fi
  :: sent == MESSAGES -> break
  od;
}

byte taken[LINKS];
byte hot = NONE;      // the link that is polled
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

inline cool() {
  was = hot;
  hot = NONE;
  store(OWNER, POLLED(was), false);
#ifndef NO_COOL_FENCE
  fence(OWNER);
#endif
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
  :: hot != link && hot != NONE -> cool(); hot = link; store(OWNER, POLLED(link), true); fence(OWNER)
#ifndef NO_REVISIT
  :: hot != link && hot != NONE -> revisit = link
#else
  :: hot != link && hot != NONE
#endif
  :: hot == NONE -> hot = link; store(OWNER, POLLED(link), true); fence(OWNER)
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
