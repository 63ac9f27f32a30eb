#pragma once

#include <cstddef>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace pellicle {

/// A text file read word by word, for formats that no library reads without loss: it knows the line of each word, so
/// that an error can name it. Words are separated by blanks; `#` starts a comment.
class TextFile {
 public:
  /// @throws Error if the file cannot be opened.
  explicit TextFile(const std::string& path);

  /// Moves to the next line that has words. False at the end of the file.
  bool next_line();
  /// Words of the present line.
  const std::vector<std::string_view>& words() const { return words_; }
  /// Next word, on whichever line it stands. @throws Error at the end of the file; `expected` names what was due.
  std::string_view next_word(const char* expected);
  /// Leaves out the unread words of the present line.
  void skip_line() { used_ = words_.size(); }
  /// How many words of the present line next_word has not given yet.
  std::size_t words_left() const { return words_.size() - used_; }

  /// A finite number. @throws Error naming file, line, word and `expected`.
  double number(std::string_view word, const char* expected) const;
  /// An integer. @throws Error naming file, line, word and `expected`.
  int integer(std::string_view word, const char* expected) const;
  /// @throws Error "FILE:LINE: message".
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string path_;
  std::ifstream stream_;
  std::string line_;
  std::vector<std::string_view> words_;
  std::size_t used_ = 0;
  int line_number_ = 0;
};

}  // namespace pellicle
