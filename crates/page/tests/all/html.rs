//! Pages as HTML: what text shows, with the keys and values of the JSON.

use hpu_page::{Cell, Column, Page, Table};

#[test]
fn html_has_the_texts_the_keys_and_the_values() {
    let rows = [("a<b", Some(2.5), true), ("c & d", None, false)];
    let table = Table::of(
        "runs",
        rows,
        [
            Column::text("", "").said().of(|_: &(&str, Option<f64>, bool)| "net"),
            Column::text("name", "name").of(|row: &(&str, Option<f64>, bool)| row.0),
            Column::number("rms_m", "rms").unit("um").of(|row: &(&str, Option<f64>, bool)| {
                let cell = Cell::new(row.1).shown(row.1.map_or("-".into(), |rms_m| format!("{:.1}", 1e6 * rms_m)));
                cell.good(row.1.is_some())
            }),
            Column::flag("settled", "").data().of(|row: &(&str, Option<f64>, bool)| row.2),
        ],
    );
    let mut page = Page::default();
    page.fact("scene.name", "scene", "wall", "the wall").line("scene", "again").data("seed", 7).note("").note("a  b");
    page.table(table);
    let mut inner = Page::default();
    inner.fact("met", "expected", true, "\"met\"");
    page.section("expected", inner);
    let expected = concat!(
        r#"<dl class="facts">
<dt>scene</dt><dd data-key="scene.name" data-value="&quot;wall&quot;">the wall</dd>
<dt></dt><dd>again</dd>
</dl>
<pre class="note">a  b</pre>
<div class="wide"><table data-table="runs">
<thead><tr><th scope="col">name</th><th scope="col" class="number">rms um</th></tr></thead>
<tbody>
<tr><td data-key="name" data-value="&quot;a&lt;b&quot;">a&lt;b</td>"#,
        r#"<td class="number good" data-key="rms_m" data-value="2.5">2500000.0</td></tr>
<tr><td data-key="name" data-value="&quot;c &amp; d&quot;">c &amp; d</td>"#,
        r#"<td class="number bad" data-key="rms_m" data-value="null">-</td></tr>
</tbody></table></div>
<div data-section="expected">
<dl class="facts">
<dt>expected</dt><dd data-key="met" data-value="true">&quot;met&quot;</dd>
</dl>
</div>
"#
    );
    assert_eq!(page.html(), expected);
    assert!(page.take_table("runs").is_some() && page.take_table("runs").is_none());
    assert!(!page.html().contains("<table"));
}
