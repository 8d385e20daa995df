#include <ostream>

#include "runtime/unblocked_output.hpp"

// Writes 1000 lines to each of its two streams in turn, and ends.
int main() {
  for (int i = 0; i < 1000; ++i) {
    km::unblocked_stdout() << "out " << i << std::endl;
    km::unblocked_stderr() << "err " << i << std::endl;
  }
}
