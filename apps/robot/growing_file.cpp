#include "apps/robot/growing_file.hpp"

#include <stdexcept>

#include "modules/core/write_file.hpp"

namespace km {

void GrowingFile::flush() {
  const std::string rows = rows_.str();
  rows_.str({});
  if (waiting_.size() + rows.size() <= kMaxWaiting_bytes)
    waiting_ += rows;
  else
    rows_lost_ = true;
  results_.write(file_, [this](const auto&) { append(); });
}

void GrowingFile::append() {
  // The first part may end in the middle of a row; what follows is the rest of it.
  if (!waiting_.empty()) append_to_file(file_, waiting_);
  if (rows_lost_)
    throw std::runtime_error(file_.string() + ": rows are missing, the disk was full for too long");
}

}  // namespace km
