#pragma once

#include <fmt/core.h>
#include <petscsys.h>

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::base {

/// Bad input, or a situation that the user must put right: `what()` is one line that names the file, key or element,
/// the value, and what was expected. `main` prints it once and ends with exit code 1.
class Error : public std::runtime_error {
 public:
  /// @param text may quote the input: control characters become \x0A and so on, and a very long text is shortened in
  /// the middle, so that it is one readable line whatever it quotes.
  explicit Error(const std::string& text);
};

/// @throws Error with a text in fmt's format, if something is wrong. The values are evaluated in any case.
template <class... Values>
void refuse_if(bool is_wrong, fmt::format_string<const Values&...> text, const Values&... values) {
  if (is_wrong) {
    throw Error(fmt::format(text, values...));
  }
}

/// Refuses input that has a fault. @param fault message about it; empty: there is none
/// @throws Error with the name of the input, such as "pins.hook", and the message behind it
inline void refuse_fault(const std::string& name, const std::string& fault) {
  refuse_if(!fault.empty(), "{}{}", name, fault);
}

/// A failed PETSc call. `what()` is one line with PETSc's own message, if keep_petsc_messages has been called.
class PetscFailure : public std::runtime_error {
 public:
  PetscFailure(PetscErrorCode code, const char* file, int line);
  PetscErrorCode code() const { return code_; }

 private:
  PetscErrorCode code_;
};

/// One line about a failure: that memory is short, if that is the reason, or else its message.
std::string words_of(const std::exception& failure);

/// Directs PETSc's error messages to PetscFailure instead of a trace on stderr. Not collective.
void keep_petsc_messages();

/// Turns a PETSc error code into an exception: `check(VecNorm(x, NORM_2, &norm));`
inline void check(PetscErrorCode code, const char* file = __builtin_FILE(), int line = __builtin_LINE()) {
  if (PetscUnlikely(code != 0)) {
    throw PetscFailure(code, file, line);
  }
}

/// The number of this rank in a communicator. Not collective.
inline int rank_of(MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

/// The number of ranks of a communicator. Not collective.
inline int ranks_of(MPI_Comm comm) {
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  return ranks;
}

/// Sends the text of one rank to every rank. Collective.
void broadcast(MPI_Comm comm, std::string& text, int from = 0);
/// Sends the texts of rank 0, in which no byte is zero, to every rank. Collective.
void broadcast(MPI_Comm comm, std::vector<std::string>& texts);

/// Runs `work`, which is not collective, on every rank; if it throws on any rank, every rank throws the Error of the
/// lowest such rank. Collective. For input handling that may fail on some ranks only.
void together(MPI_Comm comm, const std::function<void()>& work);

/// Runs `work` on rank 0 only; if it throws, every rank throws the same Error. Collective.
void on_root(MPI_Comm comm, const std::function<void()>& work);

/// The PETSc error code of the exception that is being handled.
PetscErrorCode code_of_exception() noexcept;

/// Runs C++ code inside a C callback of PETSc: an exception becomes a PETSc error code.
template <class Work>
PetscErrorCode as_petsc_callback(const Work& work) noexcept {
  try {
    work();
    return 0;
  } catch (...) {
    return code_of_exception();
  }
}

}  // namespace pellicle::base
