// SPDX-License-Identifier: MIT
// Fan-out: a server writes chunks that several clients read, while clients return them, return what
// they do not have, end their links with messages in use, and die.
//
//   publisher  claim a chunk without a holder ─ retired? ─ write ─ for each link: collect returns,
//              lend, send ─ drop its own hold
//   client     take ─ read ─ return ─ ...           or: end the link, read on, destroy the window
//   control    a client is dead or has ended its link ─ close it: collect returns, then end its
//              loans, or retire what it holds
//
//   MODELS  shm/fan_out_pool.h: hold drop retire
//   MODELS  shm/fan_out_pool.cpp: tryClaim tryReuse
//   MODELS  shm/fan_out_loans.cpp: tryLend takeBack endAll retireAll
//   MODELS  shm/link.cpp: trySendFanOut endFanOut
//   MODELS  shm/pool.cpp: collectReturned returnPacked
//   MODELS  server/publisher.cpp: publish collectReturned
//   HOLDS   no chunk is written that a living client reads or can still take, unless this client
//           has returned it early
//   HOLDS   at the end each chunk is free, or retired without a holder
//   ASSUMES a client ends its link before it gives up the lock of its window, unless it is killed
//   ASSUMES two clients: one returns what it does not have, the other is killed or ends its link;
//           two chunks, three messages; each client gets one message at a time; one thread
//           publishes, one controls
//   BREAK   TRUST_RETURNS  a return counts although the client does not hold the chunk
//   BREAK   FREE_ON_CLOSE  the chunks of a client that ends its link are free
//   BREAK   ASK_LOCK_ONLY  a client without the lock of its window counts as killed
//   BREAK   STATE_EARLY    the server reads whether the link has ended before it asks for the lock
//   BREAK   RETIRE_LATE    a chunk is retired after its holder has dropped it
//   BREAK   CLAIM_BLIND    a chunk without a holder is claimed although it is retired
//   BREAK   NO_END         the loans of a killed client are not ended
#define CLIENTS 2
#define CHUNKS 2
#define MESSAGES 3
#define NONE 9
#define LOAN(client, chunk) loans[(client) * CHUNKS + (chunk)]

byte holders[CHUNKS];
bool retired[CHUNKS];
byte loans[CLIENTS * CHUNKS];
bool isOpen[CLIENTS] = true;  // the server serves the link
bool lock[CLIENTS];     // serialises the threads of the server on a link

chan ring0 = [MESSAGES] of { byte };
chan ring1 = [MESSAGES] of { byte };
chan returns0 = [3] of { byte };
chan returns1 = [3] of { byte };

byte reading[CLIENTS] = NONE;  // the chunk that the client reads
bool hasEnded[CLIENTS];    // the client has ended its link
bool hasLock[CLIENTS] = true;     // the lock of the client's window
bool isKilled[CLIENTS];
bool hasPublished;

#define mayTake(chunk) (!isKilled[0] && !hasEnded[0] && ring0??[eval(chunk)])
#define isInUse(chunk) (reading[0] == chunk || mayTake(chunk))

// It is killed, or ends its link and reads on.
active proctype Client() {
  byte chunk;
  {
    do
    :: atomic { reading[0] == NONE && nempty(ring0) -> ring0?chunk; reading[0] = chunk }
    :: atomic { reading[0] != NONE -> chunk = reading[0]; reading[0] = NONE }
       returns0!chunk
    :: true -> break
    od;
    hasEnded[0] = true;
    hasLock[0] = false;  // the client's window may end before its messages
    reading[0] = NONE
  } unless { isKilled[0] };
  hasLock[0] = false     // the kernel releases the lock of a process that was killed
}

active proctype Killer() {
  if
  :: d_step { isKilled[0] = true; reading[0] = NONE }
  :: skip
  fi
}

// It returns everything, and once a chunk that it may not have.
active proctype MadClient() {
  byte chunk;
  bool wasMad;
  do
  :: atomic { reading[1] == NONE && nempty(ring1) -> ring1?chunk; reading[1] = chunk }
  :: atomic { reading[1] != NONE -> chunk = reading[1]; reading[1] = NONE }
     returns1!chunk
  :: !wasMad -> wasMad = true;
     if
     :: returns1!0
     :: returns1!1
     fi
  :: hasPublished && reading[1] == NONE && empty(ring1) -> break
  od;
  hasEnded[1] = true
}

inline drop(chunk) {
  d_step { assert(holders[chunk] > 0); holders[chunk]-- }
}

inline collect(client, returns) {
  do
  :: returns?found ->
#ifdef TRUST_RETURNS
     if
     :: holders[found] > 0 -> holders[found]--
     :: holders[found] == 0
     fi;
     LOAN(client, found) = 0
#else
     if
     :: d_step { LOAN(client, found) > 0 -> LOAN(client, found)--; holders[found]-- }
     :: LOAN(client, found) == 0
     fi
#endif
  :: empty(returns) -> break
  od
}

inline acquire(client) { d_step { !lock[client] -> lock[client] = true } }

inline send(client, ring, returns) {
  acquire(client);
  if
  :: isOpen[client] ->
     collect(client, returns);
     if
     :: LOAN(client, 0) + LOAN(client, 1) == 0 ->
        LOAN(client, mine)++;
        holders[mine]++;
        ring!mine
     :: LOAN(client, 0) + LOAN(client, 1) > 0  // missed
     fi
  :: !isOpen[client]
  fi;
  lock[client] = false
}

inline tryClaim(chunk) {
  holders[chunk] = 1;  // in one step with the test: see Publisher
#ifndef CLAIM_BLIND
  if
  :: retired[chunk] -> drop(chunk)
  :: !retired[chunk] -> mine = chunk
  fi
#else
  mine = chunk
#endif
}

active proctype Publisher() {
  byte sent, found, mine = NONE;
  do
  :: sent < MESSAGES ->
     sent++;
     if
     :: atomic { holders[0] == 0 -> tryClaim(0) }
     :: atomic { holders[1] == 0 -> tryClaim(1) }
     :: holders[0] > 0 && holders[1] > 0  // no memory
     fi;
     if
     :: mine != NONE ->
        assert(!isInUse(mine));  // writes the chunk
        send(0, ring0, returns0);
        send(1, ring1, returns1);
        drop(mine);
        mine = NONE
     :: mine == NONE
     fi
  :: sent == MESSAGES -> break
  od;
  hasPublished = true
}

inline endAll(client) {
  do
  :: LOAN(client, 0) > 0 -> LOAN(client, 0)--; drop(0)
  :: LOAN(client, 1) > 0 -> LOAN(client, 1)--; drop(1)
  :: LOAN(client, 0) + LOAN(client, 1) == 0 -> break
  od
}

inline retire(client) {
  if
  :: LOAN(client, 0) > 0 -> retired[0] = true
  :: LOAN(client, 0) == 0
  fi;
  if
  :: LOAN(client, 1) > 0 -> retired[1] = true
  :: LOAN(client, 1) == 0
  fi
}

inline retireAll(client) {
#ifdef RETIRE_LATE
  d_step { late0 = LOAN(client, 0); late1 = LOAN(client, 1) };
  endAll(client);
  retired[0] = retired[0] || late0 > 0;
  retired[1] = retired[1] || late1 > 0
#else
  retire(client);
  endAll(client)
#endif
}

bool isClosed;

active proctype Control() {
  byte found, late0, late1;
  bool dead, ended;
#ifdef STATE_EARLY
  ended = hasEnded[0];
#endif
  (hasEnded[0] || !hasLock[0]);
  acquire(0);
  isOpen[0] = false;
  collect(0, returns0);
  dead = !hasLock[0];
#ifndef STATE_EARLY
  ended = hasEnded[0];
#endif
#ifdef ASK_LOCK_ONLY
  ended = !dead;
#endif
  if
#ifdef NO_END
  :: dead && !ended
#else
  :: dead && !ended -> endAll(0)
#endif
#ifdef FREE_ON_CLOSE
  :: !dead || ended -> endAll(0)
#else
  :: !dead || ended -> retireAll(0)
#endif
  fi;
  lock[0] = false;
  isClosed = true
}

init {
  byte found;
  isClosed && hasPublished && hasEnded[1];
  collect(1, returns1);
  assert(holders[0] == 0 && holders[1] == 0)
}
