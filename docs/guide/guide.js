// Included source loses the indentation of its place in the file.
for (const code of document.querySelectorAll("pre > code.language-rust")) {
  const lines = code.textContent.split("\n").filter((line) => line.trim());
  const indent = Math.min(...lines.map((line) => line.search(/\S/)));
  if (indent > 0) code.innerHTML = code.innerHTML.replace(new RegExp(`^ {${indent}}`, "gm"), "");
}

// Commands wrap between words, not at the hyphens of flags.
for (const code of document.querySelectorAll("pre > code.language-console")) {
  const texts = document.createTreeWalker(code, NodeFilter.SHOW_TEXT);
  const nodes = [];
  while (texts.nextNode()) nodes.push(texts.currentNode);
  for (const node of nodes) {
    const parts = node.data.split(/([^\s]*-[^\s]*)/).map((part) => {
      if (!part.includes("-") || part.length > 36) return part;
      const word = document.createElement("span");
      word.className = "word";
      word.textContent = part;
      return word;
    });
    node.replaceWith(...parts);
  }
}
