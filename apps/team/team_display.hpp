#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace km {

/// One line per robot, redrawn in place on a terminal. Otherwise prints every line with the robot's
/// name in front.
class TeamDisplay {
 public:
  /// Prints to unblocked_stdout(); isatty() decides whether it is a terminal.
  explicit TeamDisplay(std::vector<std::string> names);
  /// For tests: `output` outlives this. `width` [characters] cuts lines on a terminal.
  TeamDisplay(std::vector<std::string> names, std::ostream& output, bool terminal, int width);

  /// The newest line of robot `index`.
  void update(std::size_t index, const std::string& line);

 private:
  void redraw();

  std::vector<std::string> names_;
  std::vector<std::string> lines_;
  std::ostream& output_;
  bool terminal_;
  std::size_t width_;
  std::size_t name_width_ = 0;
  bool drawn_ = false;
};

}  // namespace km
