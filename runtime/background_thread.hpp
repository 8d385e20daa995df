#pragma once

#include <sys/resource.h>
#include <unistd.h>

namespace km {

/// Makes the calling thread give way to the others of this host where processors are scarce: Linux
/// then gives it about a tenth of what a thread of ordinary priority gets. For handlers of work
/// that may be late, so that it does not slow down what may not. Later calls do nothing.
inline void work_in_background() {
  constexpr int kNiceness = 10;
  static thread_local const int outcome =
      setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness);
  static_cast<void>(outcome);  // where it is not allowed, the thread competes as before
}

}  // namespace km
