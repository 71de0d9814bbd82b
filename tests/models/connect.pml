// SPDX-License-Identifier: MIT
// Connect: a client finds a server, creates a link and knocks; the server accepts; the client sends
// a request. Either process may be killed before any step.
//
//   client  look up name ─ link: created, open, named ─ knock ─ (nudge) ─ connected ─ request
//           ─ reply or fate ─ link closed, name removed
//   server  knock or list of names ─ open the link ─ client alive? ─ accept ─ take ─ reply
//           a second run of the server follows the first
//
//   MODELS  client/connector.cpp: tryFindServer tryOpenLink askForAcceptance publishPendingBind closeLink
//   MODELS  client/binding.cpp: tryConnect onLinkState disconnect nudge leave
//   MODELS  server/acceptor.cpp: acceptAll rescan accept open
//   MODELS  server/connections.cpp: add open closeIfClientClosed closeDead close
//   MODELS  shm/window.cpp: knock notify
//   MODELS  shm/knocks.cpp: tryTake takeRescan
//   MODELS  shm/peer_windows.cpp: tryOpen settleAll
//   HOLDS   a running client connects to a running server, even if any hints are lost
//   HOLDS   its request ends exactly once; a request that a server acted on never ends as "never
//           taken"; a reply that was sent is not lost
//   HOLDS   a server accepts a link once, and releases it when the client has ended
//   ASSUMES sequentially consistent memory: link states use release and acquire, names are system
//           calls (ring.pml and doorbell.pml have weak memory)
//   ASSUMES a timer expires when no other step is possible; one client, two runs of a server, one
//           request for each connection
//   ASSUMES another process clears each hint once
//   BREAK   NO_NUDGE        the client knocks once
//   BREAK   NUDGE_BLIND     the client knocks again without checking whether it has been accepted
//   BREAK   ACCEPT_TWICE    a server does not remember which links it has accepted
//   BREAK   NO_WATCH        a server does not watch the clients of its links
//   BREAK   NO_DRAIN        a client ends its request without taking the reply of the dead server
//   BREAK   TAKEN_LATE      a server counts a request as taken after it has acted
//   BREAK   NO_DEATH_NEWS   a client is not notified of the death of its server
#define SERVERS 2
#define CLIENT 2
#define PROCESSES 3
#define LINKS SERVERS  // the client creates one for each run of the server
#define NONE 255
#define STRANGER 9     // a link of another client
#define NUDGES 3
#define EARLY_NUDGES 1

typedef Link {
  bool named;
  bool clientOpen;
  bool serverOpen;
  bool accepted;  // remembered by its server
  bool sent;      // a request was sent
  bool taken;     // the request counts as taken
  bool acted;     // the server has acted on the request
  bool replied;
}
Link links[LINKS];  // index: run of the server

typedef Hints {
  byte knock;     // number of a link + 1
  bool knocked;
  bool rescan;
  bool ready;     // the ready bit of the link
}
Hints hints[SERVERS];

byte serverName = NONE;  // the run of the server that has the name
bool dead[PROCESSES];
bool clientLeft;
bool news;               // the ready bit of the client

#define clientHasEnded (dead[CLIENT] || clientLeft)

inline knockAt(at, link) {
  d_step {
    if
    :: hints[at].knock != 0 && hints[at].knock != link + 1 -> hints[at].rescan = true
    :: else
    fi;
    hints[at].knock = link + 1
  };
  hints[at].knocked = true
}

// The present state of the link: accepted, replied.
inline look() {
  if
  :: links[server].serverOpen && !connected ->
    connected = true;
    links[server].sent = true;
    hints[server].ready = true
  :: links[server].replied -> goto replied
  :: else
  fi
}

inline nudge() {
  nudges++;
  if
  :: connected -> hints[server].ready = true
  :: !connected -> knockAt(server, server)
  fi;
#ifndef NUDGE_BLIND
  look()
#else
  if
  :: links[server].replied -> goto replied
  :: else
  fi
#endif
}

inline closeLink() {
  links[server].clientOpen = false;
  hints[server].ready = true;
  d_step { assert(links[server].named); links[server].named = false }
}

active proctype Client() {
  byte server, nudges;
  bool connected;
  {
    skip;
search:
    skip;
    d_step { serverName != NONE && !dead[serverName] -> server = serverName };
    d_step { links[server].clientOpen = true; links[server].named = true };
    knockAt(server, server);
    do
    :: d_step { news -> news = false }; look()
#ifndef NO_NUDGE
    :: nudges < EARLY_NUDGES -> nudge()
    :: timeout && nudges < NUDGES -> nudge()
#endif
#ifndef NO_DEATH_NEWS
    :: dead[server] -> break
#endif
    od;
#ifndef NO_DRAIN
    if
    :: links[server].replied -> goto replied
    :: else
    fi;
#endif
    // The fate of the request: "never taken", or "outcome unknown".
    assert(!links[server].replied);
    if
    :: d_step { links[server].sent && !links[server].taken -> assert(!links[server].acted) }; closeLink(); goto ended
    :: links[server].sent && links[server].taken -> closeLink(); goto ended
    :: !links[server].sent -> closeLink(); d_step { connected = false; nudges = 0 }; goto search
    fi;
replied:
    assert(links[server].sent && links[server].taken && links[server].acted);
    closeLink();
ended:
    clientLeft = true
  } unless { dead[CLIENT] }
}

inline accept(link) {
  if
#ifndef ACCEPT_TWICE
  :: links[link].accepted
  :: !links[link].accepted && links[link].named && links[link].clientOpen ->
#else
  :: links[link].named && links[link].clientOpen ->
#endif
    if
    :: !clientHasEnded ->
      d_step { assert(!links[link].accepted); links[link].accepted = true };
      links[link].serverOpen = true;
      news = true
    :: clientHasEnded
    fi
  :: else
  fi
}

inline take(link) {
  if
  :: links[link].accepted && links[link].sent && !links[link].taken ->
#ifdef TAKEN_LATE
    links[link].acted = true;
    links[link].taken = true;
#else
    links[link].taken = true;
    links[link].acted = true;
#endif
    links[link].replied = true;
    news = true
  :: else
  fi
}

proctype Server(byte me) {
  byte knocker;
  {
    if
    :: me == 0
    :: me == 1 && dead[0]
    :: me == 1 && clientHasEnded -> goto over
    fi;
    serverName = me;
    do
    :: d_step { hints[me].knocked -> hints[me].knocked = false };
      d_step { knocker = hints[me].knock; hints[me].knock = 0 };
      if
      :: knocker == me + 1 -> accept(me)
      :: else
      fi;
      knocker = 0
    :: d_step { hints[me].rescan -> hints[me].rescan = false }; accept(me)
    :: d_step { hints[me].ready -> hints[me].ready = false }; take(me)
#ifndef NO_WATCH
    :: links[me].accepted && clientHasEnded -> links[me].named = false; links[me].accepted = false
#endif
    :: !links[me].accepted && clientHasEnded -> break
    od;
over:
    skip
  } unless { dead[me] }
}

// Another peer: clears hints, and overwrites a knock with its own.
active proctype Stranger() {
  if
  :: hints[0].knock = 0
  :: knockAt(0, STRANGER)
  :: skip
  fi;
  if
  :: news = false
  :: hints[0].ready = false
  :: skip
  fi
}

active proctype Killer() {
  if
  :: dead[0] = true
  :: dead[CLIENT] = true
  :: skip
  fi
}

init {
  atomic {
    run Server(0);
    run Server(1)
  }
}
