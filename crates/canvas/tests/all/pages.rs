//! A page's picture by its pixels.

use hpu_canvas::{Canvas, HEIGHT, INK, WIDTH};

#[test]
fn a_filled_rectangle_is_where_it_was_put_and_nowhere_else() {
    let mut page = Canvas::default();
    page.fill([(100, 200), (139, 229)], INK);
    let picture = page.render("rectangle");
    let mut reader = png::Decoder::new(std::io::Cursor::new(&picture.png)).read_info().expect("a PNG");
    let mut rgb = vec![0; reader.output_buffer_size().expect("a size")];
    reader.next_frame(&mut rgb).expect("pixels");
    let ink = [INK.0, INK.1, INK.2];
    assert_eq!(rgb.len(), 3 * WIDTH as usize * HEIGHT as usize);
    for (index, pixel) in rgb.chunks_exact(3).enumerate() {
        let (x, y) = (index % WIDTH as usize, index / WIDTH as usize);
        // Whether the last row and column belong to a rectangle is the painter's choice.
        match ((100..139).contains(&x) && (200..229).contains(&y), x == 139 || y == 229) {
            (true, _) => assert_eq!(pixel, ink, "({x}, {y})"),
            (false, false) => assert_eq!(pixel, [255; 3], "({x}, {y})"),
            (false, true) => {}
        }
    }
    assert!(picture.svg.contains("<rect"));
}
