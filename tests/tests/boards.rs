//! The boards that a scene may name are the boards there are.

use dermis_golden::scene::BOARDS;
use dermis_hdl::board::Board;

#[test]
fn scenes_may_name_every_board_and_no_other() {
    assert_eq!(Board::names(), BOARDS);
}
