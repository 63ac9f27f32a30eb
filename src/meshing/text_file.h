#pragma once

#include <cstddef>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace pellicle {
inline namespace meshing {

/// A text file read word by word, for formats that no library reads without loss; errors name the line of a word. Words
/// are separated by blanks, lines by a line feed, a carriage return, or both.
class TextFile {
 public:
  /// The meaning of some characters in a format.
  struct Syntax {
    bool comments = false;  ///< `#` starts a comment, which ends with its line
    /// If not empty, a backslash at the end of a line, outside comments, joins the next line to it, unless that one
    /// begins with one of these words, which begin statements.
    std::set<std::string_view> keywords;
  };

  /// @throws Error if the file cannot be opened.
  TextFile(const std::string& path, Syntax syntax);

  /// Moves to the next line that has words. False at the end of the file.
  bool next_line();
  /// Words of the present line.
  const std::vector<std::string_view>& words() const { return words_; }
  /// Next word, of any line. @throws Error at the end of the file, which names what was `expected`.
  std::string_view next_word(const char* expected);
  /// Skips the unread words of the present line.
  void skip_line() { used_ = words_.size(); }
  /// Number of unread words of the present line.
  std::size_t words_left() const { return words_.size() - used_; }
  /// Position in the file of the line after the present one [bytes].
  std::size_t position() const { return begin_ + (rest_ == std::string::npos ? length_ : rest_); }

  /// A finite number. @throws Error naming file, line, word and `expected`.
  double number(std::string_view word, const char* expected) const;
  /// An integer. @throws Error naming file, line, word and `expected`.
  int integer(std::string_view word, const char* expected) const;
  /// A number of items, each of which takes at least `bytes` of the file, so that a wrong count is found before
  /// anything is allocated for it. @throws Error naming file, line, word and `expected`.
  int count(std::string_view word, const char* expected, std::size_t bytes) const;
  /// @throws Error "FILE:LINE: message".
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::optional<std::string> read_line();
  std::string without_comment(std::string line) const;

  std::string path_;
  Syntax syntax_;
  std::ifstream stream_;
  std::size_t size_ = 0;  ///< [bytes]
  // Text between two line feeds: one line, or several with carriage returns between them.
  std::string lines_;
  std::size_t rest_ = std::string::npos;  ///< beginning of the next line in `lines_`; npos: none
  std::size_t begin_ = 0;                 ///< of `lines_` in the file [bytes]
  std::size_t length_ = 0;                ///< of `lines_` with the line feed [bytes]
  std::optional<std::string> ahead_;      ///< a line that has been read in advance
  std::string line_;
  std::vector<std::string_view> words_;
  std::size_t used_ = 0;
  int line_number_ = 0;
};

}  // namespace meshing
}  // namespace pellicle
