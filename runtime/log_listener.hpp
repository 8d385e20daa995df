#pragma once

#include <functional>
#include <string>

#include "runtime/log.hpp"

namespace km::log {

struct Entry {
  Level level = Level::kInfo;
  std::string tag, text;
};

using Listener = std::function<void(const Entry&)>;

/// From now on `listener` hears every line that is written, one at a time, on the thread that
/// writes it: it must only enqueue, and not log. Empty: nobody does. Thread-safe; when it returns,
/// the one before is not heard any more.
void set_listener(Listener listener);

}  // namespace km::log
