#include "base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <climits>
#include <filesystem>
#include <new>
#include <utility>

namespace pellicle::base {

namespace {

std::string last_petsc_message;

PetscErrorCode keep_message(MPI_Comm, int, const char* function, const char*, PetscErrorCode code, PetscErrorType type,
                            const char* message, void*) {
  if (type == PETSC_ERROR_INITIAL) {
    last_petsc_message = std::string(message) + " (in " + function + ")";
  }
  return code;
}

std::string describe_failure(PetscErrorCode code, const char* file, int line) {
  std::string message = std::exchange(last_petsc_message, "");
  if (message.empty()) {
    const char* text = nullptr;
    PetscErrorMessage(code, &text, nullptr);
    message = text != nullptr ? text : "error " + std::to_string(code);
  }
  std::replace(message.begin(), message.end(), '\n', ' ');
  return "PETSc: " + message + ", called at " + std::filesystem::path(file).filename().string() + ":" +
         std::to_string(line);
}

std::string one_line(const std::string& text) {
  constexpr std::size_t kept_in_front = 700;
  constexpr std::size_t kept_behind = 300;
  if (text.size() > kept_in_front + kept_behind) {
    return one_line(text.substr(0, kept_in_front)) + " ... " + one_line(text.substr(text.size() - kept_behind));
  }
  std::string line;
  for (const char character : text) {
    const auto code = static_cast<unsigned char>(character);
    line += code < ' ' || code == 127 ? fmt::format("\\x{:02X}", code) : std::string(1, character);
  }
  return line;
}

}  // namespace

Error::Error(const std::string& text) : std::runtime_error(one_line(text)) {}

PetscFailure::PetscFailure(PetscErrorCode code, const char* file, int line)
    : std::runtime_error(describe_failure(code, file, line)), code_(code) {}

std::string words_of(const std::exception& failure) {
  const auto* petsc = dynamic_cast<const PetscFailure*>(&failure);
  const bool lacks_memory =
      dynamic_cast<const std::bad_alloc*>(&failure) != nullptr || (petsc != nullptr && petsc->code() == PETSC_ERR_MEM);
  return lacks_memory ? "out of memory; expected a smaller mesh, or more memory or machines" : failure.what();
}

void keep_petsc_messages() { check(PetscPushErrorHandler(keep_message, nullptr)); }

void broadcast(MPI_Comm comm, std::string& text, int from) {
  auto length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, from, comm);
  text.resize(length);
  MPI_Bcast(text.data(), length, MPI_CHAR, from, comm);
}

void broadcast(MPI_Comm comm, std::vector<std::string>& texts) {
  std::string joined;
  for (const std::string& text : texts) {
    joined += text + '\0';
  }
  broadcast(comm, joined);
  texts.clear();
  for (std::size_t begin = 0; begin < joined.size(); begin = joined.find('\0', begin) + 1) {
    texts.emplace_back(joined.c_str() + begin);
  }
}

void together(MPI_Comm comm, const std::function<void()>& work) {
  std::string message;
  int first_failed = INT_MAX;
  try {
    work();
  } catch (const std::exception& failure) {
    first_failed = rank_of(comm);
    message = words_of(failure);
  }
  MPI_Allreduce(MPI_IN_PLACE, &first_failed, 1, MPI_INT, MPI_MIN, comm);
  if (first_failed == INT_MAX) {
    return;
  }
  broadcast(comm, message, first_failed);
  throw Error(message);
}

void on_root(MPI_Comm comm, const std::function<void()>& work) {
  together(comm, [&] {
    if (rank_of(comm) == 0) {
      work();
    }
  });
}

PetscErrorCode code_of_exception() noexcept {
  try {
    throw;
  } catch (const PetscFailure& failure) {
    return failure.code();
  } catch (const std::bad_alloc& failure) {
    return PETSC_ERR_MEM;
  } catch (const std::exception& error) {
    return PetscError(PETSC_COMM_SELF, __LINE__, "callback", __FILE__, PETSC_ERR_LIB, PETSC_ERROR_INITIAL, "%s",
                      error.what());
  }
}

}  // namespace pellicle::base
