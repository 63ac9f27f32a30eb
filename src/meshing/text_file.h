#pragma once

#include <fmt/core.h>

#include <Eigen/Core>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::meshing {

/// A text file read word by word, for formats that no library reads without loss; errors name the line of a word. Words
/// are separated by blanks, lines by a line feed, a carriage return, or both.
class TextFile {
 public:
  /// @param comments whether `#` starts a comment, which ends with its line
  /// @param keywords if there are any, a backslash at the end of a line, outside comments, joins the next line to it,
  /// unless that one begins with one of these words, which begin statements
  /// @throws Error if the file cannot be opened.
  explicit TextFile(const std::string& path, bool comments = false, std::set<std::string_view> keywords = {});

  /// Moves to the next line that has words. False at the end of the file.
  bool next_line();
  /// Words of the present line.
  const std::vector<std::string_view>& words() const { return words_; }
  /// Skips the unread words of the present line.
  void skip_line() { used_ = words_.size(); }
  /// Number of unread words of the present line.
  std::size_t words_left() const { return words_.size() - used_; }
  /// The whole file, as bytes: of some formats only the beginning is text.
  const std::string& content() const { return content_; }
  /// Ends the text with the present line: errors name no line from then on. @returns where the bytes behind it begin
  std::size_t end_text() {
    is_text_ = false;
    return next_;
  }

  // The next word, of any line, as a word or as a number. @throws Error at the end of the file, which names what was
  // `expected`, and as for numbers that are given as words.
  std::string_view next_word(const char* expected);
  double next_number(const char* expected) { return number(next_word(expected), expected); }
  int next_integer(const char* expected) { return integer(next_word(expected), expected); }
  int next_count(const char* expected, std::size_t bytes) { return count(next_word(expected), expected, bytes); }
  /// Three coordinates, as next_number.
  Eigen::Vector3d next_point();

  /// A finite number. @throws Error naming file, line, word and `expected`.
  double number(std::string_view word, const char* expected) const;
  /// An integer. @throws Error naming file, line, word and `expected`.
  int integer(std::string_view word, const char* expected) const;
  /// A number of items, each of which takes at least `bytes` of the file, so that a wrong count is found before
  /// anything is allocated for it. @throws Error naming file, line, word and `expected`.
  int count(std::string_view word, const char* expected, std::size_t bytes) const;
  /// @throws Error "FILE:LINE: message", or "FILE: message" behind the text
  [[noreturn]] void fail(const std::string& message) const;
  /// @throws Error as `fail` with a text in fmt's format, if something is wrong. The values are evaluated in any case.
  template <class... Values>
  void refuse_if(bool is_wrong, fmt::format_string<const Values&...> text, const Values&... values) const {
    if (is_wrong) {
      fail(fmt::format(text, values...));
    }
  }

 private:
  std::string_view take_line();

  std::string path_;
  bool comments_;
  std::set<std::string_view> keywords_;
  std::string content_;
  std::size_t next_ = 0;  ///< beginning of the line after the present one in `content_`
  std::string line_;      ///< the present one, with those that are joined to it
  std::vector<std::string_view> words_;
  std::size_t used_ = 0;
  int line_number_ = 0;
  bool is_text_ = true;
};

}  // namespace pellicle::meshing
