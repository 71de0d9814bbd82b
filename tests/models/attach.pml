// SPDX-License-Identifier: MIT
// Attach: processes that attach remove the files of a dead client, while the client may be
// starting, running, leaving or dying.
//
//   client    window: locked, named ─ link: named ─ bulk segment: named ─ ...
//             ─ bulk, link, window: names removed ─ lock free
//   attacher  list all names ─ which windows have a living owner? ─ remove links of the others
//             ─ remove bulk segments without a link
//
//   MODELS  shm/stale_segments.cpp: judge tryRemove judgeWindow judgeOwned ownerOf
//   MODELS  shm/segment.cpp: list removeIfOwnerless
//   HOLDS   only the client itself removes names of a living client
//   HOLDS   no name of a dead client is left once a process has attached after its death and after
//           all other attachers
//   ASSUMES a listing that shows a name shows every older name that still exists (true for tmpfs)
//   ASSUMES an attacher examines all files (it does so up to 1024 of them)
//   ASSUMES one client with one link, which may be killed before any step; two attachers at any
//           time, one at the end
//   BREAK   LIST_LATE    an attacher lists the names of links after it has checked the windows
//   BREAK   LOCK_LATE    a client locks its window after the window has its name
//   BREAK   WINDOWS_ONLY an attacher does not remove links
bool windowNamed, linkNamed, bulkNamed;
bool locked;  // the client has locked its window
bool isDead;  // the client is dead; the kernel may not have released the lock yet
bool hasLeft;

#define lives (!isDead && !hasLeft)

active proctype Client() {
  {
#ifndef LOCK_LATE
    locked = true;
#endif
    windowNamed = true;
#ifdef LOCK_LATE
    locked = true;
#endif
    linkNamed = true;
    bulkNamed = true;
    d_step { assert(bulkNamed); bulkNamed = false };
    d_step { assert(linkNamed); linkNamed = false };
    d_step { assert(windowNamed); windowNamed = false };
    d_step { hasLeft = true; locked = false }
  } unless { isDead }
}

inline removeDead() {
#ifdef LIST_LATE
  windowListed = windowNamed;
#else
  d_step { windowListed = windowNamed; linkListed = linkNamed; bulkListed = bulkNamed };
#endif
  windowLives = false;
  if
  :: d_step { windowListed && windowNamed && !locked -> assert(!lives); windowNamed = false }
  // a window that no longer exists counts as alive
  :: windowListed && (!windowNamed || locked) -> windowLives = true
  :: !windowListed
  fi;
#ifdef LIST_LATE
  d_step { linkListed = linkNamed; bulkListed = bulkNamed };
#endif
  linkLives = false;
#ifndef WINDOWS_ONLY
  if
  :: linkListed && linkNamed && !windowLives -> d_step { assert(!linkNamed || !lives); linkNamed = false }
  // a link that no longer exists need not be removed
  :: linkListed && (!linkNamed || windowLives) -> linkLives = true
  :: !linkListed
  fi;
#endif
  if
  :: bulkListed && !linkLives -> d_step { assert(!bulkNamed || !lives); bulkNamed = false }
  :: !bulkListed || linkLives
  fi;
  d_step { windowListed = false; linkListed = false; bulkListed = false; windowLives = false; linkLives = false }
}

byte attached;

proctype Attacher() {
  bool windowListed, linkListed, bulkListed, windowLives, linkLives;
  removeDead();
  attached++
}

active proctype Killer() {
  if
  :: isDead = true; locked = false
  :: skip
  fi
}

init {
  atomic {
    run Attacher();
    run Attacher()
  }
  (hasLeft || isDead) && !locked && attached == 2;
  run Attacher();
  attached == 3;
  assert(!windowNamed && !linkNamed && !bulkNamed)
}
