// SPDX-License-Identifier: MIT
// Attach: programs that attach remove what a dead client left, while it may be alive, coming, leaving or dying.
//
//   client    window: locked, named ─ link: named ─ bulk segment: named ─ ... ─ bulk, link, window: names removed ─ lock free
//   attacher  list all names ─ which windows live? ─ links of the others away ─ bulk without a link away
//
//   MODELS  shm/remains.cpp: judge tryRemove judgeWindow judgeOwned ownerOf
//   MODELS  shm/segment.cpp: list removeIfOwnerless
//   HOLDS   nothing of a living client is removed by anybody but that client
//   HOLDS   nothing of a dead client keeps its name once somebody has attached after its death and after the others that attach
//   ASSUMES a listing that shows a name shows every older name that is still there (so does tmpfs: new names come first, or last)
//   ASSUMES one client with one link, which may be killed before any step; two attachers at any time, one at the end
//   BREAK   LIST_LATE    an attacher lists the names of links after it looked which windows live
//   BREAK   LOCK_LATE    a client locks its window after it got its name
//   BREAK   WINDOWS_ONLY an attacher leaves the links
bool windowNamed, linkNamed, bulkNamed;
bool locked;  // the client's window, by the client
bool isDead;  // the kernel may not have dropped the lock yet
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
  :: windowListed && (!windowNamed || locked) -> windowLives = true  // one that is gone is taken for one that lives
  :: !windowListed
  fi;
#ifdef LIST_LATE
  d_step { linkListed = linkNamed; bulkListed = bulkNamed };
#endif
  linkLives = false;
#ifndef WINDOWS_ONLY
  if
  :: linkListed && linkNamed && !windowLives -> d_step { assert(!linkNamed || !lives); linkNamed = false }
  :: linkListed && (!linkNamed || windowLives) -> linkLives = true  // one that is gone is nobody's to remove
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
