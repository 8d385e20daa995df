#include "apps/team/team_display.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "runtime/unblocked_output.hpp"

namespace km {
namespace {

int terminal_width() {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

}  // namespace

TeamDisplay::TeamDisplay(std::vector<std::string> names)
    : TeamDisplay(std::move(names), unblocked_stdout(), isatty(STDOUT_FILENO) == 1,
                  terminal_width()) {}

TeamDisplay::TeamDisplay(std::vector<std::string> names, std::ostream& output, bool terminal,
                         int width)
    : names_(std::move(names)),
      lines_(names_.size()),
      output_(output),
      terminal_(terminal),
      width_(static_cast<std::size_t>(std::max(width, 20))) {
  for (const std::string& name : names_) name_width_ = std::max(name_width_, name.size());
}

void TeamDisplay::update(std::size_t index, const std::string& line) {
  lines_[index] = line;
  if (terminal_) return redraw();
  output_ << names_[index] << std::string(name_width_ - names_[index].size(), ' ') << " | " << line
          << std::endl;
}

void TeamDisplay::redraw() {
  if (drawn_) output_ << "\x1b[" << names_.size() << 'A';
  drawn_ = true;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    std::string text =
        names_[i] + std::string(name_width_ - names_[i].size(), ' ') + " | " + lines_[i];
    output_ << "\r\x1b[K" << text.substr(0, width_ - 1) << '\n';
  }
  output_.flush();
}

}  // namespace km
