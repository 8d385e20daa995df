#pragma once

#include <cstddef>
#include <ostream>
#include <string>

namespace km {

/// How far a run is and how long it will still take: one line redrawn on a terminal, elsewhere a
/// line every kPlainInterval_s.
class Progress {
 public:
  static constexpr double kPlainInterval_s = 10.0;

  /// On standard output.
  Progress();
  Progress(std::ostream& output, bool terminal, int width);

  /// Begins to count: `present` of `total` frames are there already. Times are of any clock [s].
  void start(std::size_t present, std::size_t total, double now_s);

  /// `done` frames are there now.
  void update(std::size_t done, double now_s);

  /// The last line, and the end of the redrawing.
  void finish(std::size_t done, double now_s);

  /// What a line says.
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
