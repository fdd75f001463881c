//! Any bytes: the language gives a geometry or messages, and never panics, hangs or overflows the stack.
#![no_main]

libfuzzer_sys::fuzz_target!(|source: &[u8]| match csg::language::parse_geometry_bytes(source, "fuzz.geo") {
    Ok(parsed) => {
        let (surfaces, known) = (parsed.geometry.surfaces.len(), parsed.geometry.surface_info.len());
        assert_eq!(surfaces, known, "every surface has its place in the file");
        parsed.warnings.iter().for_each(|warning| lies_in(source, warning));
    }
    Err(failed) => {
        assert!(failed.errors().count() > 0, "a file is refused for a reason");
        failed.messages.iter().for_each(|message| lies_in(source, message));
    }
});

/// Messages name a place of the text, and can be printed.
fn lies_in(source: &[u8], message: &csg::language::Diagnostic) {
    let text = String::from_utf8_lossy(source);
    let (line, column) = (message.span.line as usize, message.span.column as usize);
    assert!(line >= 1 && line <= text.split(['\n', '\r']).count(), "{message}");
    assert!(column >= 1 && column <= message.source_line.chars().count() + 1, "{message}");
}
