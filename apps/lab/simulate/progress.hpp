#pragma once

#include <cstddef>
#include <ostream>
#include <string>

namespace km {

/// Progress and remaining time of a run: one line redrawn on a terminal, otherwise a line every
/// kPlainInterval_s.
class Progress {
 public:
  static constexpr double kPlainInterval_s = 10.0;

  /// Prints to standard output.
  Progress();
  Progress(std::ostream& output, bool terminal, int width);

  /// Begins to count: `present` of `total` frames exist already. Times are of any clock [s].
  void start(std::size_t present, std::size_t total, double now_s);

  /// Sets the number of existing frames to `done`.
  void update(std::size_t done, double now_s);

  /// Prints the last line and ends the redrawing.
  void finish(std::size_t done, double now_s);

  /// Text of a line.
  [[nodiscard]] std::string text(std::size_t done, double now_s) const;

 private:
  void draw(std::size_t done, double now_s);

  std::ostream& output_;
  bool terminal_;
  std::size_t width_;
  std::size_t present_ = 0;
  std::size_t total_ = 0;
  double start_s_ = 0.0;
  double drawn_s_ = 0.0;
};

/// "2 min 36 s"
[[nodiscard]] std::string duration_text(double seconds);

/// "1.3 GB"
[[nodiscard]] std::string size_text(double bytes);

}  // namespace km
