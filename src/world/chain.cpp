#include "world/chain.h"

#include "world/sheet_chain.h"
#include "world/wall_chain.h"

namespace pellicle {
inline namespace world {

std::unique_ptr<Chain> make_chain(const Options& options) {
  if (options.chain == ChainKind::inflate) {
    return std::make_unique<WallChain>(options);
  }
  return std::make_unique<SheetChain>(options);
}

}  // namespace world
}  // namespace pellicle
